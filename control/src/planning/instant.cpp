#include "palanquin/control/planning/instant.hpp"

namespace palanquin::planning {

void Instant::carry(RowMatrix& positions) const {
  const int count = static_cast<int>(contacts.cols());
  for (int i = 0; i < count; ++i)
    for (Eigen::Index k = 0; k < contacts.rows(); ++k) {
      if (!contacts(k, i) || is_landing(k, i)) continue;
      if (k == 0)
        point(positions, k, i) = point(feet, i, 0);
      else
        point(positions, k, i) = point(positions, k - 1, i);
    }
}

Vector3 carrying_force(const Team& team, const Flags& contacts, Eigen::Index k, int foot) {
  if (!contacts(k, foot)) return Vector3::Zero();
  const int robot = foot / kFeet;
  const auto standing = contacts.row(k).segment<kFeet>(kFeet * robot).count();
  const double mass = team.carriers[static_cast<std::size_t>(robot)].mass;
  return -1.0 / static_cast<double>(standing) * (team.share() + mass * kGravity);
}

}  // namespace palanquin::planning
