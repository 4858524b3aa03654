#pragma once

#include <Eigen/Core>

#include "palanquin/core/manifold.hpp"

namespace palanquin {

/// What is measured of a robot. `base_velocity` is of the first body's frame, in world axes,
/// `base_rate` its angular velocity in body axes.
struct RobotState {
  Vector3 base_position = Vector3::Zero();  ///< m, world
  Vector4 base_orientation{1, 0, 0, 0};     ///< (w, x, y, z), body to world
  Eigen::VectorXd joint_positions;          ///< rad, in the order of the hinges
  Vector3 base_velocity = Vector3::Zero();  ///< m/s, world
  Vector3 base_rate = Vector3::Zero();      ///< rad/s, body
  Eigen::VectorXd joint_velocities;         ///< rad/s

  bool is_finite() const {
    return base_position.allFinite() && base_orientation.allFinite() && base_velocity.allFinite() &&
           base_rate.allFinite() && joint_positions.allFinite() && joint_velocities.allFinite();
  }
  /// Of two states with as many joints.
  bool operator==(const RobotState&) const = default;
};

}  // namespace palanquin
