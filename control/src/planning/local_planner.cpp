#include "palanquin/control/planning/local_planner.hpp"

#include <chrono>

namespace palanquin::planning {

namespace {
std::string robot_name(int robot) { return "robot" + std::to_string(robot + 1); }
std::string bar_name(int bar) { return "bar" + std::to_string(bar + 1); }
}  // namespace

LocalPlanner::LocalPlanner(const BarTeam& team, int robot, bool dual_terms,
                           std::shared_ptr<LinearMpc> mpc)
    : team_(team),
      robot_(robot),
      dual_terms_(dual_terms),
      mpc_(std::move(mpc)),
      neighbours_(team.neighbours(robot)),
      bars_(team.bars_of(robot)),
      own_(mpc_->problem(), robot_name(robot)),
      op_(parameter_slot(mpc_->problem(), robot_name(robot) + ".op", 12)),
      op_input_(parameter_slot(mpc_->problem(), robot_name(robot) + ".op_input", 12)) {
  for (const int j : neighbours_) {
    const auto slot = [&](const char* part, int size) {
      return parameter_slot(mpc_->problem(), robot_name(j) + part, size);
    };
    heard_[j] = {slot(".rotation", 9),    slot(".feet", 12),     slot(".contact", 4),
                 slot(".op", 12),         slot(".op_input", 12), slot(".plan", 12),
                 slot(".plan_input", 12), slot(".dual", 12)};
  }
  for (const int b : bars_) {
    const int rows = team.bars[static_cast<std::size_t>(b)].rows;
    multipliers_[b] = {block_slot(mpc_->problem(), bar_name(b) + ".lambda", rows),
                       parameter_slot(mpc_->problem(), bar_name(b) + ".op", rows),
                       parameter_slot(mpc_->problem(), bar_name(b) + ".agreed", rows), rows};
  }
}

const Message& LocalPlanner::greet(const BarSample& sample, const RowMatrix& inputs,
                                   const Eigen::VectorXd& multipliers) {
  const int n = mpc_->horizon();
  const BodyMotion& robot = sample.robots[static_cast<std::size_t>(robot_)];
  last_.step = 0;
  last_.is_held = true;
  last_.operating = robot.rotation;
  last_.states = operating_state(robot).replicate(n + 1, 1);
  last_.inputs = inputs.middleCols<12>(12 * robot_);
  last_.bars.assign(team_.bars.size(), {});
  for (const int b : bars_)
    last_.bars[static_cast<std::size_t>(b)] =
        multipliers.segment(team_.first_row(b), multipliers_.at(b).rows)
            .transpose()
            .replicate(n, 1);
  last_.dual = RowMatrix::Zero(n, 12);
  last_.feet = sample.feet.middleRows<kFeet>(kFeet * robot_);
  return last_;
}

bool LocalPlanner::solve(int step, const BarSample& sample, double dt, const RowMatrix& inputs,
                         const std::map<int, Message>& heard, const std::map<int, double>& biases) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  const auto x = operating_state(sample.robots[static_cast<std::size_t>(robot_)]);
  RowMatrix& p = mpc_->parameters;
  write_sample(sample, robot_, own_, dt, p);
  p.middleCols<12>(op_).rowwise() = x;
  p.middleCols<12>(op_input_).topRows(inputs.rows()) = inputs.middleCols<12>(12 * robot_);
  own_.write_state(x, mpc_->guess);
  own_.write_forces(inputs, robot_, mpc_->guess);
  for (const auto& [j, message] : heard) hear(j, message, sample.contacts);
  agree(step, heard, biases);
  status_ = mpc_->solve();
  if (is_usable(status_)) {
    read_solution(step, sample);
    message_ = last_;
  } else {
    message_ = last_.aged(step - last_.step);
    message_.step = step;
  }
  solve_ms_ = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  return is_usable(status_);
}

/// Puts a neighbour's plan in place, forces only where its legs stand.
void LocalPlanner::hear(int neighbour, const Message& message, const Flags& contacts) {
  const Heard& slot = heard_.at(neighbour);
  RowMatrix& p = mpc_->parameters;
  const Eigen::Index n = mpc_->horizon();
  RowMatrix inputs = message.inputs;
  for (Eigen::Index k = 0; k < n; ++k)
    for (int f = 0; f < kFeet; ++f)
      if (!contacts(k, kFeet * neighbour + f)) point(inputs, k, f).setZero();
  const auto rotation = message.operating.reshaped<Eigen::RowMajor>().transpose();
  const auto feet = message.feet.reshaped<Eigen::RowMajor>().transpose();
  p.middleCols<9>(slot.rotation).rowwise() = Eigen::Matrix<double, 1, 9>(rotation);
  p.middleCols<12>(slot.feet).rowwise() = Eigen::Matrix<double, 1, 12>(feet);
  p.middleCols<kFeet>(slot.contact) = contacts.middleCols<kFeet>(kFeet * neighbour).cast<double>();
  p.middleCols<12>(slot.op).rowwise() = Eigen::Matrix<double, 1, 12>(message.states.row(0));
  p.middleCols<12>(slot.op_input).rowwise() = Eigen::Matrix<double, 1, 12>(inputs.row(0));
  p.middleCols<12>(slot.plan) = message.states;
  p.middleCols<12>(slot.plan_input).topRows(n) = inputs;
  if (dual_terms_)
    p.middleCols<12>(slot.dual).topRows(n) = message.dual;
  else
    p.middleCols<12>(slot.dual).topRows(n).setZero();
}

/// The agreement protocol: a_ii = a_ij = 1/2.
void LocalPlanner::agree(int step, const std::map<int, Message>& heard,
                         const std::map<int, double>& biases) {
  const int age = step - last_.step;
  for (const auto& [b, slot] : multipliers_) {
    const auto& ends = team_.bars[static_cast<std::size_t>(b)].robots;
    const int j = ends[ends[0] == robot_ ? 1 : 0];
    const RowMatrix own = last_.aged_bar(b, age);
    const RowMatrix& theirs = heard.at(j).bars[static_cast<std::size_t>(b)];
    const Eigen::RowVectorXd op = 0.5 * (own.row(0) + theirs.row(0));
    mpc_->parameters.middleCols(slot.agreed, slot.rows).topRows(own.rows()) =
        (0.5 * ((own + theirs).array() + biases.at(j))).matrix();
    mpc_->parameters.middleCols(slot.op, slot.rows).rowwise() = op;
    mpc_->guess.middleCols(slot.block, slot.rows).rowwise() = op;
  }
}

void LocalPlanner::read_solution(int step, const BarSample& sample) {
  const RowMatrix& z = mpc_->solution();
  last_.step = step;
  last_.is_held = false;
  last_.operating = sample.robots[static_cast<std::size_t>(robot_)].rotation;
  own_.read_states(z, last_.states, 0);
  own_.read_forces(z, last_.inputs, 0);
  for (const auto& [b, slot] : multipliers_)
    last_.bars[static_cast<std::size_t>(b)] =
        z.middleCols(slot.block, slot.rows).topRows(mpc_->horizon());
  last_.dual = mpc_->sqp().dynamics_multipliers();
  last_.feet = sample.feet.middleRows<kFeet>(kFeet * robot_);
}

}  // namespace palanquin::planning
