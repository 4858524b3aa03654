#pragma once

#include <random>
#include <string>
#include <vector>

#include "palanquin/control/estimation/robot_estimator.hpp"
#include "palanquin/control/whole_body/robot_state.hpp"

namespace palanquin {

/// What is wrong with a robot's sensors. All zero: they are perfect, and nobody tells its place.
struct RobotSensorSettings {
  double gyro = 0;                ///< density of white noise, rad/s/sqrt(Hz)
  double gyro_bias = 0;           ///< standard deviation at the start, each axis, rad/s
  double gyro_walk = 0;           ///< of the bias, rad/s^2/sqrt(Hz)
  double accelerometer = 0;       ///< density of white noise, m/s^2/sqrt(Hz)
  double accelerometer_bias = 0;  ///< standard deviation at the start, each axis, m/s^2
  double accelerometer_walk = 0;  ///< of the bias, m/s^3/sqrt(Hz)
  double joint_position = 0;      ///< standard deviation, rad
  double joint_resolution = 0;    ///< step of the encoders, rad
  double joint_velocity = 0;      ///< standard deviation, rad/s
  double place_rate = 0;          ///< of fixes of position and heading, Hz; 0: none
  double place_position = 0;      ///< standard deviation of each coordinate, m
  double place_heading = 0;       ///< standard deviation, rad
  double place_latency = 0;       ///< from when a fix is true to when it comes in, s
  unsigned seed = 0;

  std::string explain_invalid() const;
  /// How many periods of `dt` s the latency is.
  int place_age(double dt) const;
};

/// The sensors of one robot: IMU in the origin of the base, encoders, motors that know their
/// torques, and a system outside that sees where the base is (motion capture). The IMU gives means
/// over a period, as those do that integrate at a higher rate.
class RobotSensors {
 public:
  /// Throws std::invalid_argument with the settings' `explain_invalid()`; `dt`: a period, s.
  RobotSensors(const RobotSensorSettings& settings, double dt, double gravity = 9.81);

  /// Starts at this state.
  void start(const RobotState& state);
  /// What they say at the end of a period that ends in `state`, with these torques [joints], N m.
  const SensorReading& update(const RobotState& state, const Eigen::VectorXd& torques);

 private:
  Vector3 draw(double deviation);
  void sense_motion(const RobotState& state);
  void sense_joints(const RobotState& state);
  void sense_place(const RobotState& state);

  RobotSensorSettings settings_;
  double dt_, gravity_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  Vector3 gyro_bias_, accelerometer_bias_;
  RobotState last_;
  std::vector<PlaceFix> places_;  ///< a ring of those on their way
  long periods_ = 0;
  SensorReading reading_;
};

}  // namespace palanquin
