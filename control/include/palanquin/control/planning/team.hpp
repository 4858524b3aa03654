#pragma once

#include <array>
#include <string>
#include <vector>

#include "palanquin/control/planning/gait.hpp"

namespace palanquin::planning {

/// Acceleration of gravity, world axes, m/s^2.
inline const Vector3 kGravity(0.0, 0.0, -9.81);

/// The carried body.
struct Payload {
  double mass = 0.0;    ///< kg
  double height = 0.0;  ///< of its centre of mass over the ground, reference, m
};

/// A robot that holds the payload; positions relative to its centre of mass, in its frame, m.
struct Carrier {
  std::string name;
  Vector3 attach;  ///< grasp point in the payload's frame
  Vector3 hand;    ///< default hand position
  std::array<Vector3, kFeet> hips;
  double yaw = 0.0;              ///< reference heading relative to the payload's, rad
  double mass = 0.0;             ///< kg
  double standing_height = 0.0;  ///< m
  Gait gait;
};

/// What a robot's feet are below by default.
enum class FeetBelow {
  Hips,  ///< its hips, as in the paper
  Load,  ///< on average the zero-moment point of the robot and what it carries of the payload:
         ///< all legs bear alike while it stands
};

/// Where a robot stands in a team seen as one rigid body (14).
struct Place {
  Vector4 turn;    ///< heading relative to the payload's
  Vector3 offset;  ///< position in the payload's frame, m: the hand is on the grasp point
  /// Takes values at the hips to the value and the slopes along body x and y of the plane through
  /// them in the least-squares sense, at the centre.
  Eigen::Matrix<double, 3, kFeet> ground_fit;
  /// From the hips to what its feet are below, in its frame, m.
  Vector3 foot_shift;
};

/// Who carries what; the robots' order is the order of all arrays.
struct Team {
  /// Throws std::invalid_argument when nobody carries.
  Team(const Payload& load, std::vector<Carrier> robots, FeetBelow below = FeetBelow::Hips);

  int robots() const { return static_cast<int>(carriers.size()); }
  int bodies() const { return robots() + 1; }
  int feet() const { return kFeet * robots(); }
  /// What a foot is below by default, in its robot's frame, m.
  Vector3 above_foot(int foot) const {
    return carriers[foot / kFeet].hips[foot % kFeet] + places[foot / kFeet].foot_shift;
  }
  /// The weight of the payload that each robot carries, N.
  Vector3 share() const { return payload.mass / robots() * kGravity; }

  Payload payload;
  std::vector<Carrier> carriers;
  FeetBelow feet_below;
  std::vector<Place> places;
};

/// What is measured: states of payload and robots [R + 1, 13], feet in the world [4 R, 3], m.
struct TeamState {
  RowMatrix bodies, feet;
};

/// Planar velocity command in the payload's heading frame: forward and left, m/s; yaw rate, rad/s.
struct Velocity {
  double vx = 0.0, vy = 0.0, wz = 0.0;
};

/// Position on the plane and heading, m and rad.
struct Pose {
  double x = 0.0, y = 0.0, yaw = 0.0;
};

}  // namespace palanquin::planning
