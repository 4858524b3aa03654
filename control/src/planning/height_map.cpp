#include "palanquin/control/planning/height_map.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace palanquin::planning {

namespace {
/// B, or a derivative, at the nodes -1, 0, 1, 2 of a cell, a fraction `t` into it.
Eigen::Vector4d spline(double t, int derivative) {
  const double s = 1.0 - t;
  Eigen::Vector4d b;
  switch (derivative) {
    case 0:
      b << s * s * s, 4.0 + t * t * (3.0 * t - 6.0), 1.0 + t * (3.0 + t * (3.0 - 3.0 * t)),
          t * t * t;
      break;
    case 1:
      b << -3.0 * s * s, t * (9.0 * t - 12.0), 3.0 + t * (6.0 - 9.0 * t), 3.0 * t * t;
      break;
    default:
      b << 6.0 * s, 18.0 * t - 12.0, 6.0 - 18.0 * t, 6.0 * t;
  }
  return b / 6.0;
}
}  // namespace

HeightMap::HeightMap(RowMatrix coefficients, const Vector2& origin, double spacing,
                     std::shared_ptr<const Terrain> trend)
    : coefficients_(std::move(coefficients)),
      origin_(origin),
      spacing_(spacing),
      trend_(std::move(trend)) {
  if (std::min(coefficients_.rows(), coefficients_.cols()) < 2 + 2 * kRepeated)
    throw std::invalid_argument("height map: at least 2 rows and 2 columns are needed");
  if (!(spacing > 0.0)) throw std::invalid_argument("height map: spacing must be positive");
}

HeightMap::Patch HeightMap::at(double x, double y) const {
  // Clipped to where the map has become level.
  const auto coordinate = [this](double value, double first, Eigen::Index size) {
    const auto most = static_cast<double>(size - kRepeated - 3);
    return std::clamp((value - first) / spacing_, 2.0 - kRepeated, most);
  };
  const double u = coordinate(x, origin_.x(), coefficients_.cols());
  const double v = coordinate(y, origin_.y(), coefficients_.rows());
  const double column = std::floor(u), row = std::floor(v);
  const Eigen::Index i = static_cast<Eigen::Index>(row) - 1 + kRepeated;
  const Eigen::Index j = static_cast<Eigen::Index>(column) - 1 + kRepeated;
  return {coefficients_.block<4, 4>(i, j), u - column, v - row, spacing_};
}

double HeightMap::Patch::derivative(int m, int n) const {
  const double value = spline(v, n).dot(values * spline(u, m));
  return value / (m + n == 0 ? 1.0 : m + n == 1 ? spacing : spacing * spacing);
}

Vector2 HeightMap::slope(double x, double y) const {
  const Patch patch = at(x, y);
  return {patch.derivative(1, 0), patch.derivative(0, 1)};
}

void HeightMap::around(const Vector3& foothold, double* values) const {
  const Patch patch = at(foothold.x(), foothold.y());
  values[0] = foothold.x();
  values[1] = foothold.y();
  constexpr int kOrders[][2] = {{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}};
  for (int i = 0; i < 6; ++i) values[2 + i] = patch.derivative(kOrders[i][0], kOrders[i][1]);
}

}  // namespace palanquin::planning
