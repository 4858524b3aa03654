#include "palanquin/control/planning/distributed_planner.hpp"

#include <limits>
#include <stdexcept>

namespace palanquin::planning {

DistributedPlanner::DistributedPlanner(BarTeam team, const LayeredSettings& settings,
                                       std::vector<std::shared_ptr<LinearMpc>> problems,
                                       Links links)
    : LayeredPlanner(std::move(team), problems.at(0)->horizon(), settings) {
  const int robots = this->team().robots();
  if (static_cast<int>(problems.size()) != robots)
    throw std::invalid_argument("a distributed planner needs a problem for each robot");
  problems_ = std::move(problems);
  for (int i = 0; i < robots; ++i) {
    locals_.emplace_back(this->team(), i, settings.dual_terms,
                         problems_[static_cast<std::size_t>(i)]);
    for (const int j : locals_.back().neighbours()) {
      LinkSettings link;
      link.seed = static_cast<unsigned>(robots * j + i);
      if (const auto told = links.extract({j, i}); !told.empty()) link = told.mapped();
      links_.emplace(std::pair(j, i), link);
    }
  }
  if (!links.empty()) {
    const auto [sender, receiver] = links.begin()->first;
    throw std::invalid_argument("links: no bar joins robots " + std::to_string(sender) + " and " +
                                std::to_string(receiver));
  }
}

void DistributedPlanner::solve(const BarSample& sample, LayeredPlan& plan) {
  ++step_;
  const RowMatrix inputs = operating_inputs(sample.contacts);
  if (step_ == 0) greet(sample, inputs);
  solve_locals(sample, inputs);
  collect(plan);
}

/// Before the first sample the robots tell each other how they stand.
void DistributedPlanner::greet(const BarSample& sample, const RowMatrix& inputs) {
  const Eigen::VectorXd multipliers = operating_multipliers();
  for (LocalPlanner& local : locals_) {
    const Message& message = local.greet(sample, inputs, multipliers);
    for (const int j : local.neighbours()) links_.at({local.robot(), j}).send(message);
  }
}

void DistributedPlanner::solve_locals(const BarSample& sample, const RowMatrix& inputs) {
  std::vector<std::map<int, Message>> heard(locals_.size());
  std::vector<std::map<int, double>> biases(locals_.size());
  for (auto& [ends, link] : links_) {
    const auto [j, i] = ends;
    heard[static_cast<std::size_t>(i)][j] = link.receive(step_);
    biases[static_cast<std::size_t>(i)][j] = link.bias(step_);
  }
  for (int exchange = 0; exchange < settings().exchanges; ++exchange) {
    for (std::size_t i = 0; i < locals_.size(); ++i)
      locals_[i].solve(step_, sample, settings().dt, inputs, heard[i], biases[i]);
    if (exchange + 1 == settings().exchanges) break;
    for (const auto& [ends, link] : links_)
      heard[static_cast<std::size_t>(ends.second)][ends.first] = local(ends.first).message();
  }
  for (auto& [ends, link] : links_) link.send(local(ends.first).message());
}

/// The robots' parts as one plan; a bar's multipliers are the mean of its robots'.
void DistributedPlanner::collect(LayeredPlan& plan) const {
  const auto robots = static_cast<Eigen::Index>(locals_.size());
  plan.states.resize(horizon() + 1, 12 * robots);
  plan.inputs.resize(horizon(), 12 * robots);
  plan.operating.clear();
  plan.cost.clear();
  plan.event.clear();
  plan.status = locals_.front().status();
  plan.is_usable = true;
  for (const LocalPlanner& local : locals_) {
    const Message& message = local.message();
    plan.states.middleCols<12>(12 * local.robot()) = message.states;
    plan.inputs.middleCols<12>(12 * local.robot()) = message.inputs;
    plan.operating.push_back(message.operating);
    const bool has_solution = is_usable(local.status());
    plan.cost.push_back(has_solution ? local.mpc().sqp().model_cost()
                                     : std::numeric_limits<double>::quiet_NaN());
    if (has_solution) continue;
    if (plan.is_usable) plan.status = local.status();
    plan.is_usable = false;
    plan.event += (plan.event.empty() ? "robot " : "; robot ") + std::to_string(local.robot() + 1) +
                  ": " + local.mpc().sqp().message();
  }
  plan.bars.resize(horizon(), team().rows());
  plan.estimates.setConstant(robots, team().rows(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t b = 0; b < team().bars.size(); ++b) {
    const Bar& bar = team().bars[b];
    const int first = team().first_row(static_cast<int>(b));
    const RowMatrix& one = local(bar.robots[0]).message().bars[b];
    const RowMatrix& other = local(bar.robots[1]).message().bars[b];
    plan.bars.middleCols(first, bar.rows) = 0.5 * (one + other);
    plan.estimates.row(bar.robots[0]).segment(first, bar.rows) = one.row(0);
    plan.estimates.row(bar.robots[1]).segment(first, bar.rows) = other.row(0);
  }
}

/// A robot without a solution goes on with its own last one; the others have theirs.
void DistributedPlanner::fall_back(const BarSample& sample, LayeredPlan& plan) const {
  plan.lift_feet(sample.contacts);
}

}  // namespace palanquin::planning
