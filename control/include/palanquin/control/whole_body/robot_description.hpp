#pragma once

#include <Eigen/Core>
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

enum class LimbKind {
  Foot,  ///< a ball on the ground, which pushes only
  Hand,  ///< holds what it carries, pushes and pulls
};

/// Where a robot touches the world. Its frame has the axes of its body, and its origin in the
/// centre of the foot or where the hand holds.
struct LimbDescription {
  std::string name;
  LimbKind kind = LimbKind::Foot;
  int body = 0;
  Vector3 position = Vector3::Zero();  ///< in the body's frame, m
  double radius = 0;                   ///< of the foot's ball, m
};

/// A floating-base robot with a motor on every hinge.
struct RobotDescription {
  std::vector<BodyDescription> bodies;
  std::vector<LimbDescription> limbs;

  /// Indices of the limbs of that kind, in their order.
  std::vector<int> limbs_of(LimbKind kind) const;
  /// The hinges between the base and a body, from the base outwards, counted as joints are.
  std::vector<int> hinges_to(int body) const;

  /// What is wrong with it, in words that name body, value and rule; empty if nothing.
  std::string explain_invalid() const;
};

}  // namespace palanquin
