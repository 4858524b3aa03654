#include "palanquin/control/planning/stamped_plan.hpp"

#include <algorithm>

namespace palanquin::planning {

StampedPlan::StampedPlan(const TeamPlanner& planner)
    : spacing(Eigen::VectorXd::Constant(planner.horizon() + 1, planner.spacing())),
      knots(neutral_trajectory(planner.problem(), planner.horizon())),
      contacts(planner.instant().contacts) {}

void StampedPlan::take(const TeamPlanner& planner, bool with_gain) {
  ++number;
  const Sqp& solver = planner.solver();
  time = planner.instant().time;
  spacing = planner.spacings();
  knots = solver.trajectory();
  contacts = planner.instant().contacts;
  status = solver.status();
  is_usable = planner.has_usable_plan();
  must_stop = false;
  solve_ms = planner.solve_ms();
  solver_ms = solver.times().total();
  if (with_gain && !solver.history().empty() &&
      palanquin::is_usable(solver.history().back().qp_status))
    solver.feedback_gain(gain, gain_work);
  else
    gain.resize(0, 0);
  event_count = 0;
  for (const Event& event : planner.events()) add(event);
}

void StampedPlan::add(const Event& event) {
  if (event_count < kMostEvents) events[static_cast<std::size_t>(event_count)] = event;
  ++event_count;
}

PlanSampler::PlanSampler(const LoweredProblem& problem)
    : problem_(problem),
      at_(problem.nz()),
      later_(problem.nz()),
      dx_(problem.ndx()),
      dz_(Eigen::VectorXd::Zero(problem.ndz())) {}

void PlanSampler::sample(const StampedPlan& plan, double time, double* z) const {
  const Eigen::Index horizon = plan.knots.rows() - 1;
  double left = time - plan.time;
  Eigen::Index k = 0;
  while (k < horizon - 1 && left >= plan.spacing[k] * (1.0 - 1e-9)) left -= plan.spacing[k++];
  const double fraction = left / plan.spacing[k];
  const double *from = &plan.knots(k, 0), *to = &plan.knots(k + 1, 0);
  for (const BlockInfo& b : problem_.blocks()) {
    if (b.is_state && b.is_quaternion) {
      Eigen::Map<Vector4>(z + b.offset) =
          quaternion_interpolate(Eigen::Map<const Vector4>(from + b.offset),
                                 Eigen::Map<const Vector4>(to + b.offset), fraction);
      continue;
    }
    for (int i = b.offset; i < b.offset + b.size; ++i)
      z[i] = b.is_state ? from[i] + fraction * (to[i] - from[i]) : from[i];
  }
}

void PlanSampler::sample(const StampedPlan& plan, double time, const double* measured, double* z) {
  sample(plan, time, at_.data());
  std::copy(at_.begin(), at_.end(), z);
  if (plan.gain.size() == 0 || time - plan.time > plan.spacing[0]) return;
  state_difference(problem_, measured, at_.data(), dx_.data());
  dz_.noalias() = plan.gain * dx_;
  retract(problem_, at_.data(), dz_.data(), 1.0, z);
}

void PlanSampler::carry(const StampedPlan& plan, double time, double later, double* z) {
  sample(plan, time, at_.data());
  sample(plan, later, later_.data());
  state_difference(problem_, later_.data(), at_.data(), dx_.data());
  add_states(dx_.data(), z);
}

void PlanSampler::add_states(const double* difference, double* z) {
  dz_.setZero();
  for (const BlockInfo& b : problem_.states()) {
    std::copy_n(difference, b.tangent_size, &dz_[b.tangent_offset]);
    difference += b.tangent_size;
  }
  std::copy_n(z, problem_.nz(), at_.data());
  retract(problem_, at_.data(), dz_.data(), 1.0, z);
}

}  // namespace palanquin::planning
