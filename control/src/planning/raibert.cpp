#include "palanquin/control/planning/raibert.hpp"

#include <algorithm>
#include <cmath>

namespace palanquin::planning {

namespace {
/// How far footholds to come answer to a body that is too fast, m.
Vector2 correction(const Carrier& carrier, const Vector2& too_fast) {
  const double time = std::sqrt(carrier.standing_height / -kGravity.z());
  return (time * too_fast).cwiseMax(-kMostCorrection).cwiseMin(kMostCorrection);
}
}  // namespace

void use_raibert_footholds(const Team& team, const Terrain& terrain,
                           const std::vector<double>& times,
                           const std::vector<std::vector<Stances>>& stances,
                           const std::vector<Vector2>& too_fast, References& references) {
  for (std::size_t k = 0; k < times.size(); ++k)
    for (int r = 0; r < team.robots(); ++r) {
      const ConstBodyState robot(references.bodies, static_cast<Eigen::Index>(k), r + 1);
      const Matrix3 axes = rotation_matrix(robot.orientation);
      const Vector3 spin = axes * robot.angular_velocity;
      const Stances& s = stances[k][r];
      for (int f = 0; f < kFeet; ++f) {
        const Vector3 hip = axes * team.above_foot(kFeet * r + f);
        const double to_middle = (s.begin[f] + s.end[f]) / 2 - times[k];
        Vector3 foot = robot.position + hip + to_middle * (robot.velocity + spin.cross(hip));
        if (s.begin[f] > times[0]) foot.head<2>() += correction(team.carriers[r], too_fast[r]);
        foot.z() = terrain.height(foot.x(), foot.y());
        point(references.footholds, static_cast<Eigen::Index>(k), kFeet * r + f) =
            foot - robot.position;
      }
    }
}

}  // namespace palanquin::planning
