#pragma once

#include <optional>
#include <vector>

#include "palanquin/plant/measurement.hpp"
#include "palanquin/plant/robot_sensors.hpp"

namespace palanquin {

/// A robot's estimator, and the sensors that it has to do with.
struct EstimationSettings {
  RobotSensorSettings sensors;
  RobotEstimatorSettings estimator;
  bool feels_feet = false;  ///< the forces on its feet are measured, not estimated
};

/// Errors of the estimate of one robot, from its start: roots of mean squares, and the worst.
struct EstimationErrors {
  double position = 0, largest_position = 0;        ///< of the base, m
  double orientation = 0, largest_orientation = 0;  ///< rad
  double velocity = 0, largest_velocity = 0;        ///< m/s
};

/// What a robot may lose.
enum class Sense { State, FootForces };

/// What a robot's controller takes for its state and for the forces on its feet: the truth, the
/// truth with noise, or an estimate.
class RobotSenses {
 public:
  RobotSenses(const RobotDescription& robot, const MeasurementSettings& measurement,
              const std::optional<EstimationSettings>& estimation, double dt);

  /// At the start, and then at the end of each period: what truly is.
  void start(const RobotState& truth, const Eigen::Matrix3Xd& forces);
  void update(const RobotState& truth, const Eigen::Matrix3Xd& forces,
              const Eigen::VectorXd& torques, const std::vector<bool>& stands,
              const Eigen::Matrix3Xd& normals);

  /// From now on there is nothing but NaN of it, or again what there was.
  void lose(Sense sense, bool is_lost);

  const RobotState& state() const;
  const Eigen::Matrix3Xd& foot_forces() const;  ///< [3, feet], world, N
  EstimationErrors errors() const;              ///< all 0 without an estimator

 private:
  struct Estimation {
    RobotSensors sensors;
    RobotEstimator estimator;
    bool feels_feet;
  };
  void compare(const RobotState& known, const RobotState& truth);

  double dt_;
  Measurement measurement_;
  std::optional<Estimation> estimation_;
  Eigen::Matrix3Xd forces_;
  std::optional<RobotState> no_state_;         ///< while it is lost
  std::optional<Eigen::Matrix3Xd> no_forces_;  ///< likewise
  EstimationErrors sums_;
  long periods_ = 0;
};

}  // namespace palanquin
