#pragma once

#include <array>
#include <vector>

#include "palanquin/control/planning/arrays.hpp"

namespace palanquin::planning {

/// A bar between two robots, as planners at a rate know it.
struct Bar {
  std::array<int, 2> robots{0, 1};
  int rows = 1;  ///< holonomic rows, and multipliers
};

/// Robots on bars; their order is the order of all arrays.
struct BarTeam {
  std::vector<double> masses;  ///< kg
  std::vector<Bar> bars;

  int robots() const { return static_cast<int>(masses.size()); }
  int feet() const { return kFeet * robots(); }
  int rows() const;              ///< of all bars
  int first_row(int bar) const;  ///< of a bar among them
  /// Robots at the other ends of a robot's bars, in order.
  std::vector<int> neighbours(int robot) const;
  std::vector<int> bars_of(int robot) const;
};

/// Position (m) and velocity (m/s) of a centre of mass in the world, rotation body to world,
/// angular velocity (rad/s, body axes).
struct BodyMotion {
  Vector3 position = Vector3::Zero(), velocity = Vector3::Zero();
  Matrix3 rotation = Matrix3::Identity();
  Vector3 angular_velocity = Vector3::Zero();
};

/// What a sample of robots on bars is planned from.
struct BarSample {
  double time = 0.0;                ///< s
  std::vector<BodyMotion> robots;   ///< measured, [M]
  RowMatrix feet;                   ///< world, m, [4 M, 3]; in the air, where they will stand
  Flags contacts;                   ///< at the knots [N + 1, 4 M]; the last row is not looked at
  std::vector<BodyMotion> desired;  ///< now, [M]; they move on with these velocities
};

}  // namespace palanquin::planning
