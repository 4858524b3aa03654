#include "palanquin/control/planning/bar_planner.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "palanquin/control/planning/references.hpp"
#include "palanquin/core/text_lines.hpp"

namespace palanquin::planning {

RowMatrix BarPlan::reference_states() const {
  RowMatrix states = RowMatrix::Zero(static_cast<Eigen::Index>(references.size()), kState);
  for (std::size_t i = 0; i < references.size(); ++i) {
    BodyState state(states, static_cast<Eigen::Index>(i), 0);
    state.position = references[i].position;
    state.orientation = from_yaw(references[i].yaw);
    state.velocity = references[i].velocity;
    state.angular_velocity.z() = references[i].yaw_rate;
  }
  return states;
}

double BarPlan::friction_violation(double friction) const {
  double worst = 0.0;
  for (Eigen::Index i = 0; i < feet.rows(); ++i) {
    const Vector3 force = point(mpc.inputs, 0, i);
    const double cone = friction / std::numbers::sqrt2 * force.z();
    worst = std::max(worst, force.head<2>().cwiseAbs().maxCoeff() - cone);
  }
  return worst;
}

BarPlanner::BarPlanner(std::shared_ptr<LayeredPlanner> planner, const Leash& leash)
    : planner_(std::move(planner)), leash_(leash) {}

const BarPlan& BarPlanner::plan(const BarMeasurement& seen, const Flags& contacts,
                                const std::vector<Velocity>& commands) {
  check(seen, contacts, commands);
  lead(seen, commands);
  take(seen, contacts);
  answer(seen, planner_->plan(sample_));
  return plan_;
}

void BarPlanner::check(const BarMeasurement& seen, const Flags& contacts,
                       const std::vector<Velocity>& commands) const {
  const int robots = planner_->team().robots(), feet = planner_->team().feet();
  const auto has_shape = [](const auto& matrix, Eigen::Index rows, Eigen::Index columns) {
    return matrix.rows() == rows && matrix.cols() == columns;
  };
  if (!has_shape(seen.bodies, robots, kState) || !has_shape(seen.feet, feet, 3) ||
      !has_shape(seen.footholds, feet, 3) || seen.ground.size() != robots ||
      !has_shape(contacts, planner_->horizon() + 1, feet) ||
      static_cast<int>(commands.size()) != robots)
    throw std::invalid_argument(
        "of " + std::to_string(robots) + " robots there are bodies [M, 13], feet and footholds " +
        "[4 M, 3], heights of the ground [M], contacts [" +
        std::to_string(planner_->horizon() + 1) + ", 4 M] and a command each");
  if (!seen.bodies.allFinite() || !seen.ground.allFinite())
    throw std::invalid_argument("measured states and heights of the ground must be finite");
}

/// Moves the references on; the first ones are where the robots stand.
void BarPlanner::lead(const BarMeasurement& seen, const std::vector<Velocity>& commands) {
  if (references_.empty()) {
    for (Eigen::Index i = 0; i < seen.bodies.rows(); ++i)
      references_.push_back(reference_at(ConstBodyState(seen.bodies, i, 0)));
    time_ = seen.time;
  }
  if (!(seen.time >= time_))
    throw std::invalid_argument("time is " + to_text(seen.time) +
                                " s; it must be finite and must not go back");
  const double elapsed =
      std::round(1e9 * (seen.time - time_)) / 1e9;  // without two times' rounding
  for (std::size_t i = 0; i < references_.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    references_[i].advance(commands[i], ConstBodyState(seen.bodies, row, 0), seen.ground[row],
                           leash_, elapsed);
  }
  time_ = seen.time;
}

/// What is seen and wanted, as the layered planners take it.
void BarPlanner::take(const BarMeasurement& seen, const Flags& contacts) {
  sample_.time = seen.time;
  sample_.contacts = contacts;
  sample_.feet = seen.footholds;
  for (Eigen::Index i = 0; i < seen.feet.rows(); ++i)
    if (contacts(0, i)) sample_.feet.row(i) = seen.feet.row(i);
  sample_.robots.resize(references_.size());
  sample_.desired.resize(references_.size());
  for (std::size_t i = 0; i < references_.size(); ++i) {
    const ConstBodyState body(seen.bodies, static_cast<Eigen::Index>(i), 0);
    sample_.robots[i] = {body.position, body.velocity, rotation_matrix(body.orientation),
                         body.angular_velocity};
    sample_.desired[i] = references_[i].motion();
  }
}

void BarPlanner::answer(const BarMeasurement& seen, const LayeredPlan& layered) {
  plan_.mpc = layered;
  plan_.contacts = sample_.contacts;
  plan_.feet = sample_.feet;
  plan_.references = references_;
  plan_.events.clear();
  if (!layered.is_usable) plan_.events.push_back({layered.time, EventKind::KeptPlan});
  plan_.bodies.resize(layered.states.rows(), kState * layered.robots());
  for (Eigen::Index k = 0; k < plan_.bodies.rows(); ++k)
    for (int i = 0; i < layered.robots(); ++i) {
      const auto x = layered.states.row(k).segment<12>(12 * i);
      const Vector4 measured = ConstBodyState(seen.bodies, i, 0).orientation;
      BodyState body(plan_.bodies, k, i);
      body.position = x.segment<3>(0);
      body.orientation = quaternion_multiply(measured, quaternion_exp(x.segment<3>(6)));
      body.velocity = x.segment<3>(3);
      body.angular_velocity = x.segment<3>(9);
    }
}

}  // namespace palanquin::planning
