#pragma once

#include <optional>
#include <string>
#include <vector>

#include "palanquin/control/estimation/base_estimator.hpp"
#include "palanquin/control/estimation/foot_force_observer.hpp"
#include "palanquin/control/whole_body/robot_model.hpp"

namespace palanquin {

/// What the sensors of a robot say in one period.
struct SensorReading {
  ImuSample imu;                     ///< mean over the period; the IMU is in the base's origin
  Eigen::VectorXd joint_positions;   ///< at its end, rad
  Eigen::VectorXd joint_velocities;  ///< rad/s
  Eigen::VectorXd torques;           ///< of the motors over the period, N m
  std::optional<PlaceFix> place;     ///< if one has come in
  int place_age = 0;                 ///< periods since it was true
};

struct RobotEstimatorSettings {
  BaseEstimatorSettings base;
  double joint_position = 1e-3;  ///< standard deviation of encoders, rad
  double leg = 1e-3;             ///< of a foot's place for all else, m
  double force_bandwidth = 150;  ///< of the observer of the feet's forces, 1/s

  /// What is wrong with it, in words; empty if nothing.
  std::string explain_invalid() const;
};

/// The state of one robot and the forces on its feet from its IMU, its joints and the torques of
/// its motors: what its controller takes for measured. Feet are balls that roll on the ground.
///
/// Nothing allocates after construction.
class RobotEstimator {
 public:
  /// Throws std::invalid_argument for bad settings or a robot that can't be. `memory`: of how many
  /// periods ago places may be.
  explicit RobotEstimator(const RobotDescription& robot,
                          const RobotEstimatorSettings& settings = {}, int memory = 0);

  /// Starts over at about this state.
  void start(const RobotState& about);
  /// One period of `dt` s. `stands` [feet]: which feet the controller had on the ground, whose
  /// normals [3, feet] are upwards; no columns: it is level.
  void update(const SensorReading& reading, double dt, const std::vector<bool>& stands,
              const Eigen::Matrix3Xd& normals);

  const RobotState& state() const { return state_; }
  const Eigen::Matrix3Xd& foot_forces() const { return forces_.forces(); }  ///< world, N
  const BaseEstimator& base() const { return base_; }

 private:
  const LimbKinematics& foot(std::size_t index) const;
  void correct_feet();
  void read_base(const Vector3& rate);

  RobotEstimatorSettings settings_;
  RobotModel model_;
  BaseEstimator base_;
  FootForceObserver forces_;
  RobotState state_;
  std::vector<FootMotion> motions_;
  std::vector<std::vector<int>> legs_;  ///< hinges of each
};

}  // namespace palanquin
