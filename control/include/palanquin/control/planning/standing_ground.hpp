#pragma once

#include <memory>

#include "palanquin/control/planning/ditches.hpp"
#include "palanquin/control/planning/terrain.hpp"

namespace palanquin::planning {

/// Footholds to choose from: those that a terrain offers, and two ways out of a ditch for each.
struct Choices {
  static constexpr int kMost = 2 * Offers::kMost;
  std::array<Vector3, kMost> points;
  int count = 0;
  void add(const Vector3& p) { points[static_cast<std::size_t>(count++)] = p; }
};

/// Where feet may stand: what the terrain offers, outside of ditches.
class StandingGround {
 public:
  StandingGround(std::shared_ptr<const Terrain> terrain, Ditches ditches)
      : terrain_(std::move(terrain)), ditches_(std::move(ditches)) {}

  const Terrain& terrain() const { return *terrain_; }
  const Ditches& ditches() const { return ditches_; }
  /// Whether feet may stand everywhere.
  bool is_whole() const { return ditches_.is_empty() && !terrain_->has_gaps(); }
  /// The foothold nearest to a point. One that is not `landing` is moved out of ditches only, which
  /// constrain it too.
  Vector3 nearest(const Vector3& wanted, bool landing) const;
  /// Footholds to choose from: the terrain's, and both ways out of a ditch.
  Choices options(const Vector3& wanted) const;

 private:
  Vector3 on_ground(const Vector2& p) const {
    return {p.x(), p.y(), terrain_->height(p.x(), p.y())};
  }

  std::shared_ptr<const Terrain> terrain_;
  Ditches ditches_;
};

}  // namespace palanquin::planning
