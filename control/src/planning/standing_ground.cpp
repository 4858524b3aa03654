#include "palanquin/control/planning/standing_ground.hpp"

namespace palanquin::planning {

Vector3 StandingGround::nearest(const Vector3& wanted, bool landing) const {
  const Vector3 offered = landing ? terrain_->nearest(wanted) : wanted;
  return ditches_.is_empty() ? offered : on_ground(ditches_.nearest_clear(offered.head<2>()));
}

Choices StandingGround::options(const Vector3& wanted) const {
  const Offers offers = terrain_->options(wanted);
  const auto is_clear = [&](int i) { return ditches_.deepest(offers.points[i].head<2>()) <= 0.0; };
  Choices choices;
  for (int i = 0; i < offers.count; ++i)
    if (is_clear(i)) choices.add(offers.points[i]);
  for (const bool nearer : {true, false})
    for (int i = 0; i < offers.count; ++i)
      if (!is_clear(i)) choices.add(on_ground(ditches_.leave(offers.points[i].head<2>(), nearer)));
  return choices;
}

}  // namespace palanquin::planning
