#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "palanquin/control/whole_body/robot_description.hpp"
#include "palanquin/control/whole_body/robot_state.hpp"

namespace palanquin {

/// Position, velocity, Jacobian and drift of a point, in world axes: p'' = J v' + drift.
struct PointKinematics {
  Vector3 position, velocity, drift;
  Eigen::Matrix3Xd jacobian;
};

/// The motion of a limb's frame: of its origin, and of its axes, omega' = J_w v' + drift_w.
struct LimbKinematics : PointKinematics {
  Eigen::Matrix3d rotation;  ///< of its axes, to the world
  Vector3 rate;              ///< omega, world axes, rad/s
  Vector3 angular_drift;     ///< world axes, rad/s^2
  Eigen::Matrix3Xd angular_jacobian;
};

/// Kinematics and dynamics of one robot in a state, by Pinocchio:
///
///   D v' + H = [0; tau] + sum (J' f + J_w' m)
///
/// for forces f and moments m of the world on its limbs: (24) of Kim et al. ("Layered control for
/// cooperative locomotion of two quadrupedal robots"), without the interaction force.
///
/// The generalised velocity v is the base's linear and angular velocity in *body axes*, then the
/// joints' rates; v has 6 + n entries for n hinges. D contains the rotors' inertias, H gravity,
/// centrifugal and Coriolis terms and the hinges' damping. Nothing allocates after construction.
class RobotModel {
 public:
  /// Throws std::invalid_argument with `explain_invalid()`.
  explicit RobotModel(const RobotDescription& description);
  ~RobotModel();
  RobotModel(RobotModel&&) noexcept;

  const RobotDescription& description() const { return description_; }
  int nv() const;
  int joints() const { return nv() - 6; }
  int limbs() const { return static_cast<int>(description_.limbs.size()); }
  const std::vector<int>& feet() const { return feet_; }    ///< which limbs they are
  const std::vector<int>& hands() const { return hands_; }  ///< which limbs they are
  double mass() const;
  const Eigen::VectorXd& effort() const;  ///< [n], N m

  /// Evaluates all that follows, unless it is of this very state already. The state has n joints;
  /// otherwise std::invalid_argument.
  void update(const RobotState& state);

  const Eigen::VectorXd& velocity() const;      ///< v
  const Eigen::MatrixXd& mass_matrix() const;   ///< D, both triangles
  const Eigen::VectorXd& bias() const;          ///< H
  const PointKinematics& com() const;           ///< of the whole robot
  const LimbKinematics& limb(int index) const;  ///< std::out_of_range if there is none
  const Eigen::Matrix3d& rotation() const;      ///< of the base, body to world
  double joint_position(int joint) const;       ///< rad; std::out_of_range if there is none

 private:
  struct Pinocchio;
  RobotDescription description_;
  std::vector<int> feet_, hands_;
  std::unique_ptr<Pinocchio> pinocchio_;
};

}  // namespace palanquin
