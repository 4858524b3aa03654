#include "palanquin/plant/robot_senses.hpp"

#include <algorithm>
#include <cmath>

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
  compare(truth);
}

void RobotSenses::compare(const RobotState& truth) {
  const RobotState& known = state();
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

const RobotState& RobotSenses::state() const {
  return estimation_ ? estimation_->estimator.state() : measurement_.current();
}

const Eigen::Matrix3Xd& RobotSenses::foot_forces() const {
  return estimation_ && !estimation_->feels_feet ? estimation_->estimator.foot_forces() : forces_;
}

EstimationErrors RobotSenses::errors() const {
  EstimationErrors result = sums_;
  for (double* sum : {&result.position, &result.orientation, &result.velocity})
    *sum = periods_ > 0 ? std::sqrt(*sum / static_cast<double>(periods_)) : 0;
  return result;
}

}  // namespace palanquin
