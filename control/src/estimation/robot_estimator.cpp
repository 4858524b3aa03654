#include "palanquin/control/estimation/robot_estimator.hpp"

#include <stdexcept>

#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

namespace {

const RobotDescription& checked(const RobotDescription& robot,
                                const RobotEstimatorSettings& settings) {
  if (const std::string text = settings.explain_invalid(); !text.empty())
    throw std::invalid_argument("robot estimator: " + text);
  return robot;
}

}  // namespace

std::string RobotEstimatorSettings::explain_invalid() const {
  return SettingRules()
      .nested("base.", base.explain_invalid())
      .not_negative("joint_position", joint_position)
      .positive("leg", leg)
      .positive("force_bandwidth", force_bandwidth)
      .sentence();
}

RobotEstimator::RobotEstimator(const RobotDescription& robot,
                               const RobotEstimatorSettings& settings, int memory)
    : settings_(settings),
      model_(checked(robot, settings)),
      base_(static_cast<int>(model_.feet().size()), settings.base, memory),
      forces_(model_, settings.force_bandwidth),
      motions_(model_.feet().size()) {
  for (const int foot : model_.feet())
    legs_.push_back(robot.hinges_to(robot.limbs[static_cast<std::size_t>(foot)].body));
}

void RobotEstimator::start(const RobotState& about) {
  model_.update(about);
  state_ = about;
  Eigen::Matrix3Xd feet(3, base_.feet());
  for (std::size_t i = 0; i < motions_.size(); ++i)
    feet.col(static_cast<Eigen::Index>(i)) = foot(i).position;
  base_.start(about.base_position, about.base_orientation, about.base_velocity, feet);
  forces_ = FootForceObserver(model_, settings_.force_bandwidth);
}

const LimbKinematics& RobotEstimator::foot(std::size_t index) const {
  return model_.limb(model_.feet()[index]);
}

void RobotEstimator::update(const SensorReading& reading, double dt,
                            const std::vector<bool>& stands, const Eigen::Matrix3Xd& normals) {
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const auto limb = static_cast<std::size_t>(model_.feet()[i]);
    const Vector3 normal = normals.cols() > 0 ? Vector3(normals.col(column)) : Vector3::UnitZ();
    motions_[i].stands = stands.at(i);
    motions_[i].velocity = foot(i).rate.cross(model_.description().limbs[limb].radius * normal);
  }
  base_.predict(reading.imu, dt, motions_);
  state_.joint_positions = reading.joint_positions;
  state_.joint_velocities = reading.joint_velocities;
  read_base(reading.imu.rate);
  model_.update(state_);
  forces_.update(model_, reading.torques, dt);
  correct_feet();
  if (reading.place) base_.correct_place(*reading.place, reading.place_age);
  read_base(reading.imu.rate);
}

/// Where the feet are in the base, as the encoders have it.
void RobotEstimator::correct_feet() {
  const Eigen::Matrix3d to_base = model_.rotation().transpose();
  for (std::size_t i = 0; i < motions_.size(); ++i) {
    Eigen::Matrix3d covariance = settings_.leg * settings_.leg * Eigen::Matrix3d::Identity();
    for (const int hinge : legs_[i]) {
      const Vector3 turned = settings_.joint_position * to_base * foot(i).jacobian.col(6 + hinge);
      covariance += turned * turned.transpose();
    }
    const Vector3 arm = to_base * (foot(i).position - state_.base_position);
    base_.correct_foot(static_cast<int>(i), arm, covariance);
  }
}

void RobotEstimator::read_base(const Vector3& rate) {
  state_.base_position = base_.position();
  state_.base_orientation = base_.orientation();
  state_.base_velocity = base_.velocity();
  state_.base_rate = rate - base_.gyro_bias();
}

}  // namespace palanquin
