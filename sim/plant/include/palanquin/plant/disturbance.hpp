#pragma once

#include <Eigen/Core>
#include <string>
#include <variant>

#include "palanquin/core/manifold.hpp"

namespace palanquin {

/// A force on a body at a point of it, from `start` to `end`:
///   amplitude * sin(2 pi (t - start) / period + phase), axis by axis, world axes.
/// An infinite period with phase pi / 2 makes it constant.
struct Push {
  int body = 0;
  Vector3 point = Vector3::Zero();        ///< body frame, m
  Vector3 amplitude = Vector3::Zero();    ///< N
  Vector3 period = Vector3::Constant(1);  ///< s
  Vector3 phase = Vector3::Zero();        ///< rad
  double start = 0, end = 0;              ///< s

  Vector3 force(double time) const;
};

/// A rope from a point of a body to an anchor that moves steadily: it pulls when it is taut, by
/// stiffness * (length - slack) + damping * (rate of length), never pushing.
struct Tether {
  int body = 0;
  Vector3 point = Vector3::Zero();     ///< body frame, m
  Vector3 anchor = Vector3::Zero();    ///< at `start`, world, m
  Vector3 velocity = Vector3::Zero();  ///< of the anchor, m/s
  double slack = 0;                    ///< length without force, m
  double stiffness = 0, damping = 0;   ///< N/m, N s/m
  double start = 0, end = 0;           ///< s

  /// For the point at `position` with `point_velocity`, world axes.
  Vector3 force(double time, const Vector3& position, const Vector3& point_velocity) const;
};

using Disturbance = std::variant<Push, Tether>;

/// What is wrong with it, in words; empty if nothing. `bodies` is how many the model has.
std::string explain_invalid(const Disturbance& disturbance, int bodies);

}  // namespace palanquin
