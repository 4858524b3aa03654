#pragma once

#include <Eigen/Core>

#include "palanquin/core/manifold.hpp"
#include "palanquin/core/trajectory.hpp"

namespace palanquin::planning {

// Arrays over knots are row-major matrices with one row a knot. Bodies are ordered payload, robots;
// feet LF, RF, LH, RH of the first robot, then of the second: foot i belongs to robot i / kFeet.

constexpr int kFeet = 4;    ///< of a robot
constexpr int kState = 13;  ///< numbers of a body's state, see BodyState

using Vector2 = Eigen::Vector2d;
using Matrix3 = Eigen::Matrix3d;
/// Contact flags [n, 4 R].
using Flags = Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Point `i` of row `k` of points [n, 3 m].
inline Eigen::Map<Vector3> point(RowMatrix& points, Eigen::Index k, Eigen::Index i) {
  return Eigen::Map<Vector3>(&points(k, 3 * i));
}
inline Eigen::Map<const Vector3> point(const RowMatrix& points, Eigen::Index k, Eigen::Index i) {
  return Eigen::Map<const Vector3>(&points(k, 3 * i));
}

/// State of body `b` in row `k` of states [n, 13 m]: position (world, m), orientation (w, x, y, z,
/// body to world), velocity (world, m/s), angular velocity (body, rad/s).
struct BodyState {
  BodyState(RowMatrix& states, Eigen::Index k, Eigen::Index b)
      : position(&states(k, kState * b)),
        orientation(position.data() + 3),
        velocity(position.data() + 7),
        angular_velocity(position.data() + 10) {}
  Eigen::Map<Vector3> position;
  Eigen::Map<Vector4> orientation;
  Eigen::Map<Vector3> velocity, angular_velocity;
};
struct ConstBodyState {
  ConstBodyState(const RowMatrix& states, Eigen::Index k, Eigen::Index b)
      : position(&states(k, kState * b)),
        orientation(position.data() + 3),
        velocity(position.data() + 7),
        angular_velocity(position.data() + 10) {}
  Eigen::Map<const Vector3> position;
  Eigen::Map<const Vector4> orientation;
  Eigen::Map<const Vector3> velocity, angular_velocity;
};

}  // namespace palanquin::planning
