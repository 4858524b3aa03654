#include "palanquin/plant/robot_sensors.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

namespace {

constexpr double kLongestLatency = 1;  // s

Eigen::Quaterniond quaternion(const Vector4& q) { return {q[0], q[1], q[2], q[3]}; }

}  // namespace

std::string RobotSensorSettings::explain_invalid() const {
  return SettingRules()
      .not_negative("gyro", gyro)
      .not_negative("gyro_bias", gyro_bias)
      .not_negative("gyro_walk", gyro_walk)
      .not_negative("accelerometer", accelerometer)
      .not_negative("accelerometer_bias", accelerometer_bias)
      .not_negative("accelerometer_walk", accelerometer_walk)
      .not_negative("joint_position", joint_position)
      .not_negative("joint_resolution", joint_resolution)
      .not_negative("joint_velocity", joint_velocity)
      .not_negative("place_rate", place_rate)
      .not_negative("place_position", place_position)
      .not_negative("place_heading", place_heading)
      .not_negative("place_latency", place_latency)
      .check(place_latency <= kLongestLatency, "place_latency", place_latency, "at most 1 s")
      .sentence();
}

int RobotSensorSettings::place_age(double dt) const {
  return static_cast<int>(std::lround(place_latency / dt));
}

RobotSensors::RobotSensors(const RobotSensorSettings& settings, double dt, double gravity)
    : settings_(settings), dt_(dt), gravity_(gravity), random_(settings.seed) {
  const std::string text =
      SettingRules().nested(settings.explain_invalid()).positive("dt", dt).sentence();
  if (!text.empty()) throw std::invalid_argument("robot sensors: " + text);
  gyro_bias_ = draw(settings.gyro_bias);
  accelerometer_bias_ = draw(settings.accelerometer_bias);
  reading_.place_age = settings.place_age(dt);
  places_.resize(static_cast<std::size_t>(reading_.place_age) + 1);
}

void RobotSensors::start(const RobotState& state) {
  last_ = state;
  periods_ = 0;
  reading_.joint_positions = state.joint_positions;
  reading_.joint_velocities = state.joint_velocities;
  reading_.torques.setZero(state.joint_positions.size());
}

const SensorReading& RobotSensors::update(const RobotState& state, const Eigen::VectorXd& torques) {
  ++periods_;
  sense_motion(state);
  sense_joints(state);
  sense_place(state);
  reading_.torques = torques;
  last_ = state;
  return reading_;
}

Vector3 RobotSensors::draw(double deviation) {
  if (deviation == 0) return Vector3::Zero();
  const double x = normal_(random_), y = normal_(random_), z = normal_(random_);
  return deviation * Vector3(x, y, z);
}

void RobotSensors::sense_motion(const RobotState& state) {
  const double rough = 1 / std::sqrt(dt_);
  const Vector3 turn = quaternion_minus(state.base_orientation, last_.base_orientation);
  const Vector3 force =
      (state.base_velocity - last_.base_velocity) / dt_ + gravity_ * Vector3::UnitZ();
  reading_.imu.rate = turn / dt_ + gyro_bias_ + draw(settings_.gyro * rough);
  reading_.imu.specific_force = quaternion(last_.base_orientation).conjugate() * force +
                                accelerometer_bias_ + draw(settings_.accelerometer * rough);
  gyro_bias_ += draw(settings_.gyro_walk / rough);
  accelerometer_bias_ += draw(settings_.accelerometer_walk / rough);
}

void RobotSensors::sense_joints(const RobotState& state) {
  reading_.joint_positions = state.joint_positions;
  reading_.joint_velocities = state.joint_velocities;
  if (settings_.joint_position > 0)
    for (double& angle : reading_.joint_positions)
      angle += settings_.joint_position * normal_(random_);
  if (settings_.joint_resolution > 0)
    for (double& angle : reading_.joint_positions)
      angle = settings_.joint_resolution * std::round(angle / settings_.joint_resolution);
  if (settings_.joint_velocity > 0)
    for (double& rate : reading_.joint_velocities)
      rate += settings_.joint_velocity * normal_(random_);
}

/// One is taken whenever another period of `place_rate` has begun, and comes in when it is as old
/// as its latency.
void RobotSensors::sense_place(const RobotState& state) {
  reading_.place.reset();
  if (settings_.place_rate == 0) return;
  const auto is_taken = [&](long period) {
    const double cycles = dt_ * settings_.place_rate;
    return std::floor(static_cast<double>(period) * cycles + 1e-9) >
           std::floor(static_cast<double>(period - 1) * cycles + 1e-9);
  };
  const auto slot = [&](long period) -> PlaceFix& {
    return places_[static_cast<std::size_t>(period) % places_.size()];
  };
  if (is_taken(periods_)) {
    // Of a perfect one the estimator still needs to know how far to trust it.
    constexpr double kLeastPosition = 1e-4, kLeastHeading = 1e-4;
    const double angle = draw(settings_.place_heading).z();
    slot(periods_) = {state.base_position + draw(settings_.place_position),
                      quaternion_multiply(quaternion_exp({0, 0, angle}), state.base_orientation),
                      std::max(settings_.place_position, kLeastPosition),
                      std::max(settings_.place_heading, kLeastHeading)};
  }
  const long then = periods_ - reading_.place_age;
  if (then > 0 && is_taken(then)) reading_.place = slot(then);
}

}  // namespace palanquin
