#include "palanquin/plant/measurement.hpp"

#include <stdexcept>

#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

namespace {

constexpr int kLongestDelay = 1000;

}  // namespace

std::string MeasurementSettings::explain_invalid() const {
  return SettingRules()
      .not_negative("position", position)
      .not_negative("orientation", orientation)
      .not_negative("velocity", velocity)
      .not_negative("rate", rate)
      .not_negative("joint_position", joint_position)
      .not_negative("joint_velocity", joint_velocity)
      .check(delay >= 0 && delay <= kLongestDelay, "delay", delay,
             "from 0 to " + std::to_string(kLongestDelay) + " periods")
      .sentence();
}

Measurement::Measurement(const MeasurementSettings& settings)
    : settings_(settings), random_(settings.seed) {
  if (auto text = settings.explain_invalid(); !text.empty())
    throw std::invalid_argument("measurement: " + text);
  history_.resize(static_cast<std::size_t>(settings.delay) + 1);
}

const RobotState& Measurement::update(const RobotState& state) {
  RobotState& slot = history_[oldest_];
  slot = state;
  add_noise(slot);
  if (!has_started_) history_.assign(history_.size(), RobotState(slot));
  has_started_ = true;
  oldest_ = (oldest_ + 1) % history_.size();
  return history_[oldest_];
}

Vector3 Measurement::draw(double deviation) {
  if (deviation == 0) return Vector3::Zero();
  const double x = normal_(random_), y = normal_(random_), z = normal_(random_);
  return deviation * Vector3(x, y, z);
}

void Measurement::add_noise(RobotState& state) {
  const auto add = [&](Eigen::VectorXd& values, double deviation) {
    if (deviation > 0)
      for (double& value : values) value += deviation * normal_(random_);
  };
  state.base_position += draw(settings_.position);
  state.base_orientation = quaternion_plus(state.base_orientation, draw(settings_.orientation));
  state.base_velocity += draw(settings_.velocity);
  state.base_rate += draw(settings_.rate);
  add(state.joint_positions, settings_.joint_position);
  add(state.joint_velocities, settings_.joint_velocity);
}

}  // namespace palanquin
