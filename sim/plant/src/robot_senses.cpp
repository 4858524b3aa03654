#include "palanquin/plant/robot_senses.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palanquin {

RobotSenses::RobotSenses(const RobotDescription& robot, const MeasurementSettings& measurement,
                         const std::optional<EstimationSettings>& estimation, double dt)
    : dt_(dt), measurement_(measurement) {
  if (!estimation) return;
  RobotSensors sensors(estimation->sensors, dt);  // checks the latency, which is the memory
  const int memory = estimation->sensors.place_age(dt);
  estimation_.emplace(Estimation{std::move(sensors),
                                 RobotEstimator(robot, estimation->estimator, memory),
                                 estimation->feels_feet});
}

void RobotSenses::start(const RobotState& truth, const Eigen::Matrix3Xd& forces) {
  forces_ = forces;
  measurement_.update(truth);
  if (!estimation_) return;
  estimation_->sensors.start(truth);
  estimation_->estimator.start(truth);
}

void RobotSenses::update(const RobotState& truth, const Eigen::Matrix3Xd& forces,
                         const Eigen::VectorXd& torques, const std::vector<bool>& stands,
                         const Eigen::Matrix3Xd& normals) {
  forces_ = forces;
  if (!estimation_) {
    measurement_.update(truth);
    return;
  }
  const SensorReading& reading = estimation_->sensors.update(truth, torques);
  estimation_->estimator.update(reading, dt_, stands, normals);
  compare(estimation_->estimator.state(), truth);
}

void RobotSenses::compare(const RobotState& known, const RobotState& truth) {
  const auto add = [](double error, double& sum, double& largest) {
    sum += error * error;
    largest = std::max(largest, error);
  };
  add((known.base_position - truth.base_position).norm(), sums_.position, sums_.largest_position);
  add(quaternion_minus(known.base_orientation, truth.base_orientation).norm(), sums_.orientation,
      sums_.largest_orientation);
  add((known.base_velocity - truth.base_velocity).norm(), sums_.velocity, sums_.largest_velocity);
  ++periods_;
}

void RobotSenses::lose(Sense sense, bool is_lost) {
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
  if (sense == Sense::FootForces) {
    no_forces_.reset();
    if (is_lost) no_forces_ = Eigen::Matrix3Xd::Constant(3, forces_.cols(), kNothing);
    return;
  }
  no_state_.reset();
  if (!is_lost) return;
  RobotState& nothing = no_state_.emplace(state());
  for (Vector3* v : {&nothing.base_position, &nothing.base_velocity, &nothing.base_rate})
    v->setConstant(kNothing);
  nothing.base_orientation.setConstant(kNothing);
  nothing.joint_positions.setConstant(kNothing);
  nothing.joint_velocities.setConstant(kNothing);
}

const RobotState& RobotSenses::state() const {
  if (no_state_) return *no_state_;
  return estimation_ ? estimation_->estimator.state() : measurement_.current();
}

const Eigen::Matrix3Xd& RobotSenses::foot_forces() const {
  if (no_forces_) return *no_forces_;
  return estimation_ && !estimation_->feels_feet ? estimation_->estimator.foot_forces() : forces_;
}

EstimationErrors RobotSenses::errors() const {
  EstimationErrors result = sums_;
  for (double* sum : {&result.position, &result.orientation, &result.velocity})
    *sum = periods_ > 0 ? std::sqrt(*sum / static_cast<double>(periods_)) : 0;
  return result;
}

}  // namespace palanquin
