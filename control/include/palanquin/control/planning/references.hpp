#pragma once

#include <vector>

#include "palanquin/control/planning/team.hpp"
#include "palanquin/control/planning/terrain.hpp"

namespace palanquin::planning {

/// How robots' references follow from the payload's.
enum class RobotReferences {
  Rigid,   ///< as one rigid body with it, (14) of De Vincenti and Coros
  Ground,  ///< each over its own ground, see follow_ground
};

/// Reference motion over a horizon.
struct References {
  RowMatrix bodies;     ///< states [N + 1, 13 (R + 1)]
  RowMatrix footholds;  ///< r_f*, relative to the robot's position, world axes, m, [N + 1, 12 R]
  /// Reference foot in the world, m.
  Vector3 foot(Eigen::Index k, int i) const {
    return ConstBodyState(bodies, k, 1 + i / kFeet).position + point(footholds, k, i);
  }
};

/// A knot of the payload's way over the ground.
struct PathKnot {
  Pose pose;
  Vector2 slope;  ///< of the ground, dz/dx and dz/dy
};

/// The payload's path by explicit Euler steps of the velocity, tilted onto the ground, one knot
/// every `dt` seconds from `start` on; fills `path`. The smallest rotation that takes the z axis to
/// the normal (-s, 1) / l of a ground of slope s takes a horizontal vector c to one whose
/// horizontal part is c - (s . c) s / (l (1 + l)).
void payload_path(const Terrain& ground, const Pose& start, const Velocity& command, double dt,
                  std::vector<PathKnot>& path);

/// One such step: the pose `dt` seconds later, and the slope where it starts.
PathKnot step_along(const Terrain& ground, const Pose& start, const Velocity& command, double dt);

/// Reference motions (III-C of De Vincenti and Coros) of payload, robots and footholds. Does not
/// allocate but for construction.
class ReferenceMotion {
 public:
  /// Keeps references to team and terrain.
  ReferenceMotion(const Team& team, const Terrain& terrain, RobotReferences robots, int horizon,
                  double dt);
  /// From the payload's reference pose at knot 0 on, under a command that stays.
  void make(const Pose& start, const Velocity& command, References& references);

 private:
  void move_rigidly(const Velocity& command);
  void follow_ground();
  void project_hips(References& references) const;

  const Team& team_;
  const Terrain& terrain_;
  const Terrain& trend_;
  RobotReferences robots_;
  double dt_;
  std::vector<PathKnot> path_;  ///< [N + 2]
  RowMatrix bodies_;            ///< [N + 2, 13 (R + 1)]
};

/// Standing still at a payload pose.
TeamState nominal_state(const Team& team, const Terrain& terrain, const Pose& pose,
                        RobotReferences robots);

/// A heading (rad) tilted onto ground of `slope` (dz/dx, dz/dy): a turn about z, then the smallest
/// rotation that takes z to the ground's normal.
Vector4 on_slope(const Vector2& slope, double yaw);
/// Rotation by `yaw` radians about z.
Vector4 from_yaw(double yaw);
/// The rotation matrix, whose columns are the body's axes in the world frame.
Matrix3 rotation_matrix(const Vector4& q);

}  // namespace palanquin::planning
