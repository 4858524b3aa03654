#include "palanquin/control/planning/centralized_planner.hpp"

namespace palanquin::planning {

CentralizedPlanner::CentralizedPlanner(BarTeam team, const LayeredSettings& settings,
                                       std::shared_ptr<LinearMpc> mpc)
    : LayeredPlanner(std::move(team), mpc->horizon(), settings) {
  for (int i = 1; i <= this->team().robots(); ++i)
    robots_.emplace_back(mpc->problem(), "robot" + std::to_string(i));
  int number = 0;
  for (const Bar& bar : this->team().bars)
    multipliers_.push_back(
        block_slot(mpc->problem(), "bar" + std::to_string(++number) + ".lambda", bar.rows));
  problems_.push_back(std::move(mpc));
}

void CentralizedPlanner::linearize_at(const BarSample& sample) {
  LinearMpc& mpc = *problems_.front();
  const RowMatrix inputs = operating_inputs(sample.contacts);
  const Eigen::VectorXd multipliers = operating_multipliers();
  for (int i = 0; i < team().robots(); ++i) {
    const BarRobotSlots& slots = robots_[static_cast<std::size_t>(i)];
    slots.write_state(operating_state(sample.robots[static_cast<std::size_t>(i)]), mpc.guess);
    slots.write_forces(inputs, i, mpc.guess);
    write_sample(sample, i, slots, settings().dt, mpc.parameters);
  }
  for (std::size_t b = 0; b < multipliers_.size(); ++b) {
    const int bar = static_cast<int>(b), rows = team().bars[b].rows;
    mpc.guess.middleCols(multipliers_[b], rows).rowwise() =
        multipliers.segment(team().first_row(bar), rows).transpose();
  }
}

void CentralizedPlanner::solve(const BarSample& sample, LayeredPlan& plan) {
  linearize_at(sample);
  LinearMpc& mpc = *problems_.front();
  plan.status = mpc.solve();
  plan.is_usable = is_usable(plan.status);
  if (!plan.is_usable) {
    plan.event = mpc.sqp().message();
    return;
  }
  const RowMatrix& z = mpc.solution();
  plan.states.resize(horizon() + 1, 12 * team().robots());
  plan.inputs.resize(horizon(), 12 * team().robots());
  plan.operating.resize(sample.robots.size());
  for (int i = 0; i < team().robots(); ++i) {
    robots_[static_cast<std::size_t>(i)].read_states(z, plan.states, 12 * i);
    robots_[static_cast<std::size_t>(i)].read_forces(z, plan.inputs, 12 * i);
    plan.operating[static_cast<std::size_t>(i)] =
        sample.robots[static_cast<std::size_t>(i)].rotation;
  }
  plan.bars.resize(horizon(), team().rows());
  for (std::size_t b = 0; b < multipliers_.size(); ++b) {
    const int bar = static_cast<int>(b), rows = team().bars[b].rows;
    plan.bars.middleCols(team().first_row(bar), rows) =
        z.middleCols(multipliers_[b], rows).topRows(horizon());
  }
  plan.estimates = plan.bars.topRows(1).replicate(team().robots(), 1);
  plan.cost.assign(1, mpc.sqp().model_cost());
}

}  // namespace palanquin::planning
