#pragma once

#include <Eigen/Core>
#include <vector>

#include "palanquin/control/whole_body/robot_model.hpp"

namespace palanquin {

/// The ground's forces on the feet from the torques of their legs, for robots without sensors in
/// their feet:
///
///   J_leg' f = D v' + H - tau        rows of the leg's hinges,
///
/// both sides through a low-pass filter of first order, so that only velocities are differentiated:
/// with D held over the filter's time this is the residual of generalised momentum of De Luca and
/// Mattone ("Sensorless robot collision detection and hybrid force/motion control", ICRA 2005). A
/// touchdown shows after about 1 / bandwidth.
///
/// Hinges of a leg are those between the base and its foot. Nothing allocates after construction.
class FootForceObserver {
 public:
  /// Throws std::invalid_argument unless `bandwidth` (1/s) is positive and every foot has a hinge.
  explicit FootForceObserver(const RobotModel& model, double bandwidth = 150);

  /// On by `dt` s, over which `torques` [joints] acted; `model` is updated with the state now.
  void update(const RobotModel& model, const Eigen::VectorXd& torques, double dt);

  const Eigen::Matrix3Xd& forces() const { return forces_; }  ///< [3, feet], world, N

 private:
  double bandwidth_;
  std::vector<std::vector<int>> legs_;  ///< hinges of each
  Eigen::VectorXd velocity_;            ///< filtered
  Eigen::VectorXd load_;                ///< H - tau of all hinges, filtered
  Eigen::VectorXd acceleration_, residual_;
  Eigen::Matrix3Xd forces_;
  bool has_started_ = false;
};

}  // namespace palanquin
