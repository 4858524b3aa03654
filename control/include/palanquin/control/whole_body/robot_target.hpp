#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "palanquin/control/whole_body/task_targets.hpp"

namespace palanquin {

/// What is known of the wrench that a hand's load puts on it.
enum class HandLoad {
  Known,   ///< the wrench of the target
  Force,   ///< about the target's force, and no moment: a load that turns freely
  Wrench,  ///< about the target's force and moment
};

struct HandTarget {
  PointTarget point;  ///< at `RobotTarget::time`
  std::optional<OrientationTarget> orientation;
  Wrench wrench;  ///< of the load on the hand
  HandLoad load = HandLoad::Known;
};

/// What the planner wants of one robot, and the command it was given; world axes but for rates.
struct RobotTarget {
  double time = 0;                     ///< at which the state below is due, s
  Vector3 position = Vector3::Zero();  ///< of the centre of mass, m
  Vector3 velocity = Vector3::Zero();  ///< m/s
  Vector3 acceleration = Vector3::Zero();
  Vector4 orientation{1, 0, 0, 0};  ///< of the base, (w, x, y, z)
  Vector3 rate = Vector3::Zero();   ///< rad/s, body axes
  Vector3 rate_derivative = Vector3::Zero();
  Eigen::Matrix3Xd forces;                       ///< of the ground on the feet, [3, feet], N
  Vector3 commanded_velocity = Vector3::Zero();  ///< of the base, for the footholds, m/s
  double commanded_yaw_rate = 0;                 ///< rad/s

  /// Where swinging feet are to land, [3, feet], m; a column that is not finite, or no columns at
  /// all: the controller chooses.
  Eigen::Matrix3Xd footholds;
  /// Of the ground at the feet, upwards, [3, feet]; no columns: it is level.
  Eigen::Matrix3Xd normals;
  std::vector<HandTarget> hands;  ///< one a hand; none: the arms keep their first angles
};

/// The motion of a hand's frame, world axes.
struct HandObservation {
  Vector3 position = Vector3::Zero();  ///< where it holds, m
  Vector4 orientation{1, 0, 0, 0};     ///< (w, x, y, z), to the world
  Vector3 velocity = Vector3::Zero();  ///< m/s
  Vector3 rate = Vector3::Zero();      ///< rad/s
};

/// What a planner needs to know of a robot; positions in world axes, m and m/s.
struct RobotObservation {
  Vector3 position, velocity;  ///< of the centre of mass
  Vector4 orientation;         ///< of the base, (w, x, y, z)
  Vector3 rate;                ///< of the base, body axes, rad/s
  Eigen::Matrix3Xd feet;       ///< contact points, as on level ground
  Eigen::Matrix3Xd footholds;  ///< where feet stand or are to land
  std::vector<HandObservation> hands;
  double ground = 0.0;  ///< mean height at which the feet last stood
};

}  // namespace palanquin
