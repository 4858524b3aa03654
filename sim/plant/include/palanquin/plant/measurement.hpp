#pragma once

#include <random>
#include <string>
#include <vector>

#include "palanquin/control/whole_body/robot_state.hpp"

namespace palanquin {

/// What lies between a robot's state and what its controller knows: white noise of these standard
/// deviations, and a delay of whole control periods. All zero: the state itself.
struct MeasurementSettings {
  double position = 0;        ///< of the base, m
  double orientation = 0;     ///< of the base, about each axis, rad
  double velocity = 0;        ///< of the base, m/s
  double rate = 0;            ///< of the base, rad/s
  double joint_position = 0;  ///< rad
  double joint_velocity = 0;  ///< rad/s
  int delay = 0;              ///< control periods
  unsigned seed = 0;

  std::string explain_invalid() const;
};

/// The measured state of one robot, one period after the other.
class Measurement {
 public:
  explicit Measurement(const MeasurementSettings& settings);

  /// The measurement of this period, of the state `delay` periods ago (the first one before that).
  const RobotState& update(const RobotState& state);
  const RobotState& current() const { return history_[oldest_]; }

 private:
  void add_noise(RobotState& state);
  Vector3 draw(double deviation);

  MeasurementSettings settings_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  std::vector<RobotState> history_;  ///< a ring of delay + 1 measurements
  std::size_t oldest_ = 0;
  bool has_started_ = false;
};

}  // namespace palanquin
