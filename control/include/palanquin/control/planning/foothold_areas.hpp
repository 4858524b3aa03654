#pragma once

#include <memory>
#include <span>
#include <vector>

#include "palanquin/control/planning/terrain.hpp"

namespace palanquin::planning {

/// A convex polygon that feet may stand on, with the plane z = z0 + ax x + ay y over it.
struct FootholdArea {
  RowMatrix half_spaces;  ///< (a, b, c) [sides, 3]: a x + b y + c <= 0 where feet may stand, m
  RowMatrix corners;      ///< of that polygon, anticlockwise, m, [sides, 2]; they may be repeated
  Vector3 plane;          ///< (z0, ax, ay)
};

/// Ground of which only convex areas may be stepped on (De Vincenti and Coros, after (11)). Where
/// there is none, the height is that of the nearest one.
class FootholdAreas : public Terrain {
 public:
  /// Areas with equally many sides; all of them within `low` and `high` (x, y), m; the ground as
  /// bodies follow it, itself if there is none.
  FootholdAreas(std::vector<FootholdArea> areas, const Vector2& low, const Vector2& high,
                std::shared_ptr<const Terrain> trend);

  double height(double x, double y) const override;
  Vector2 slope(double x, double y) const override;
  const Terrain& trend() const override { return trend_ ? *trend_ : *this; }
  std::vector<LocalParameter> local_parameters() const override;
  /// Half-spaces and plane of the area in which the point lies, or the nearest; of several the one
  /// nearest in z.
  void around(const Vector3& foothold, double* values) const override;
  bool has_gaps() const override { return true; }
  Vector3 nearest(const Vector3& wanted) const override { return options(wanted).points[0]; }
  /// The nearest points of the nearest areas, distances seen from above.
  Offers options(const Vector3& wanted) const override;
  void write(std::string& text, const std::string& folder) const override;
  /// By how much a point misses the worst half-space of the nearest area, m.
  double excess(double x, double y) const;

 private:
  std::span<const int> near(double x, double y) const;
  const FootholdArea& chosen(const Vector3& p) const;
  void build_lookup(const Vector2& low, const Vector2& high);

  std::vector<FootholdArea> areas_;
  std::shared_ptr<const Terrain> trend_;
  Vector2 least_, most_;  ///< (x, y) of all areas
  Vector2 low_ = Vector2::Zero();
  int nx_ = 0, ny_ = 0, count_ = 0;  ///< of the grid, and areas at each of its points
  std::vector<int> lookup_;          ///< those missed by least, [nx, ny, count]
};

/// The point of a convex polygon (corners anticlockwise, [n, 2]) nearest to `p`.
Vector2 nearest_in_polygon(const RowMatrix& corners, const Vector2& p);

}  // namespace palanquin::planning
