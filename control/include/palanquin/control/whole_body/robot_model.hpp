#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "palanquin/core/manifold.hpp"

namespace palanquin {

/// A link. The first one of a robot floats; every other one turns about `axis` against its parent,
/// or is fixed to it.
struct BodyDescription {
  std::string name;
  int parent = -1;                     ///< index of an earlier body; -1 for the first
  Vector3 position = Vector3::Zero();  ///< of its frame in the parent's, m
  Vector4 orientation{1, 0, 0, 0};     ///< (w, x, y, z), into the parent's frame
  Vector3 axis = Vector3::Zero();      ///< of its hinge, own axes; zero: fixed to the parent
  double mass = 0;                     ///< kg
  Vector3 com = Vector3::Zero();       ///< centre of mass, own frame, m
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< about `com`, own axes, kg m^2
  double armature = 0;                                ///< rotor's inertia seen at the hinge, kg m^2
  double damping = 0;                                 ///< viscous friction of the hinge, N m s
  double effort = 0;                                  ///< torque limit of the hinge's motor, N m
};

/// A point on a body that contacts or tasks refer to.
struct PointDescription {
  std::string name;
  int body = 0;
  Vector3 position = Vector3::Zero();  ///< in the body's frame, m
};

/// A floating-base robot with a motor on every hinge.
struct RobotDescription {
  std::vector<BodyDescription> bodies;
  std::vector<PointDescription> points;

  /// What is wrong with it, in words that name body, value and rule; empty if nothing.
  std::string explain_invalid() const;
};

/// What is measured of a robot. `base_velocity` is of the first body's frame, in world axes,
/// `base_rate` its angular velocity in body axes.
struct RobotState {
  Vector3 base_position = Vector3::Zero();  ///< m, world
  Vector4 base_orientation{1, 0, 0, 0};     ///< (w, x, y, z), body to world
  Eigen::VectorXd joint_positions;          ///< rad, in the order of the hinges
  Vector3 base_velocity = Vector3::Zero();  ///< m/s, world
  Vector3 base_rate = Vector3::Zero();      ///< rad/s, body
  Eigen::VectorXd joint_velocities;         ///< rad/s

  bool is_finite() const;
};

/// Position, velocity, Jacobian and drift of a point, in world axes: p'' = J v' + drift.
struct PointKinematics {
  Vector3 position, velocity, drift;
  Eigen::Matrix3Xd jacobian;
};

/// Kinematics and dynamics of one robot in a state, by Pinocchio:
///
///   D v' + H = [0; tau] + sum J' f      (24) of Kim et al., without the interaction force.
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

  int nv() const;
  int joints() const { return nv() - 6; }
  int points() const;
  double mass() const;
  const Eigen::VectorXd& effort() const;  ///< [n], N m

  /// Evaluates all that follows. The state has n joints; otherwise std::invalid_argument.
  void update(const RobotState& state);

  const Eigen::VectorXd& velocity() const;        ///< v
  const Eigen::MatrixXd& mass_matrix() const;     ///< D, both triangles
  const Eigen::VectorXd& bias() const;            ///< H
  const PointKinematics& com() const;             ///< of the whole robot
  const PointKinematics& point(int index) const;  ///< std::out_of_range if there is none
  const Eigen::Matrix3d& rotation() const;        ///< of the base, body to world

 private:
  struct Pinocchio;
  std::unique_ptr<Pinocchio> pinocchio_;
};

}  // namespace palanquin
