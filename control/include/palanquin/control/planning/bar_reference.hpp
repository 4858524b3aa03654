#pragma once

#include "palanquin/control/planning/bar_team.hpp"
#include "palanquin/control/planning/team.hpp"

namespace palanquin::planning {

/// How far ahead of its robot a reference (x, y) may be, m: held back or pushed away, a robot does
/// not have to make up for more.
struct Leash {
  enum class Shape {
    Circle,  ///< at most `length` in any direction
    Square,  ///< at most `length` along each axis of the world
  };
  Shape shape = Shape::Circle;
  double length = 0.15;

  Vector2 hold(const Vector2& ahead) const;
};

/// Of the centre of mass over the ground, m (Kim et al., V-A.1).
inline constexpr double kBarStandingHeight = 0.26;
/// Farthest that a reference's heading runs ahead of the robot's, rad.
inline constexpr double kYawLeash = 0.3;

/// The state that one robot on bars is to have now: centre of mass over the ground, level, on
/// course.
struct BarReference {
  Vector3 position = Vector3::Zero();  ///< m, world
  Vector3 velocity = Vector3::Zero();  ///< m/s, world
  double yaw = 0.0;                    ///< rad
  double yaw_rate = 0.0;               ///< rad/s

  /// Moves on by `dt` (s) under a command in the reference's own heading, no farther ahead of the
  /// robot in state `body` [13] than the leash has it; `ground` is the height below it, m.
  void advance(const Velocity& command, const ConstBodyState& body, double ground,
               const Leash& leash, double dt);
  BodyMotion motion() const;
};

/// The reference of a robot that is to stay where it is.
BarReference reference_at(const ConstBodyState& body);

/// Yaw of a robot's x axis in the world, rad.
double heading(const Vector4& orientation);

}  // namespace palanquin::planning
