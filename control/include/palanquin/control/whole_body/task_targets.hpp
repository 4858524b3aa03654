#pragma once

#include "palanquin/core/manifold.hpp"

namespace palanquin {

/// Where a point should be, in world axes.
struct PointTarget {
  Vector3 position = Vector3::Zero(), velocity = Vector3::Zero(), acceleration = Vector3::Zero();
};

/// How a body should be turned; rate and its derivative in its own axes.
struct OrientationTarget {
  Vector4 orientation{1, 0, 0, 0};  ///< (w, x, y, z), body to world
  Vector3 rate = Vector3::Zero(), acceleration = Vector3::Zero();
};

/// Where a hinge should be.
struct JointTarget {
  double position = 0, velocity = 0, acceleration = 0;  ///< rad, rad/s, rad/s^2
};

/// Of the world on a limb, at its origin, world axes.
struct Wrench {
  Vector3 force = Vector3::Zero();   ///< N
  Vector3 moment = Vector3::Zero();  ///< N m
};

}  // namespace palanquin
