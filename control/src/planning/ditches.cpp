#include "palanquin/control/planning/ditches.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace palanquin::planning {

namespace {
constexpr double kMargin = 0.01;  // from the edge, of a point that has left a ditch, m
}

Ditches::Ditches(MatrixView lines) : lines_(lines) {
  if (lines.cols() != 4) throw std::invalid_argument("ditches: lines (a, b, c, d) are [n, 4]");
  lengths_ = lines_.leftCols<2>().rowwise().norm();
  for (Eigen::Index i = 0; i < lines_.rows(); ++i)
    if (!(lengths_[i] > 0.0 && lines_(i, 3) >= 0.0 && lines_.row(i).allFinite()))
      throw std::invalid_argument("ditches[" + std::to_string(i) +
                                  "]: a line needs a direction (a, b) and a width of at least 0");
}

/// Signed distance of a point from a ditch's centre line, m.
double Ditches::offset(Eigen::Index ditch, const Vector2& p) const {
  return (p.x() * lines_(ditch, 0) + p.y() * lines_(ditch, 1) + lines_(ditch, 2)) / lengths_[ditch];
}

double Ditches::depth(Eigen::Index ditch, const Vector2& p) const {
  return lines_(ditch, 3) / 2 - std::abs(offset(ditch, p));
}

double Ditches::deepest(const Vector2& p) const {
  double deepest = 0.0;
  for (Eigen::Index i = 0; i < size(); ++i) deepest = std::max(deepest, depth(i, p));
  return deepest;
}

Vector2 Ditches::leave(const Vector2& p, bool nearer) const {
  Vector2 moved = p, direction = Vector2::Zero();
  for (Eigen::Index step = 0; step < size(); ++step) {
    Eigen::Index in = 0;
    for (Eigen::Index i = 1; i < size(); ++i)
      if (depth(i, moved) > depth(in, moved)) in = i;
    if (depth(in, moved) <= 0.0) break;
    const double from_middle = offset(in, moved);
    const Vector2 normal = lines_.row(in).head<2>().transpose() / lengths_[in];
    if (direction.isZero(0.0)) direction = (from_middle >= 0.0) == nearer ? normal : -normal;
    const double side = normal.dot(direction) >= 0.0 ? 1.0 : -1.0;
    moved += (side * (lines_(in, 3) / 2 + kMargin) - from_middle) * normal;
  }
  return moved;
}

Vector2 Ditches::nearest_clear(const Vector2& p) const {
  const Vector2 nearer = leave(p, true), other = leave(p, false);
  return (other - p).norm() < (nearer - p).norm() ? other : nearer;
}

}  // namespace palanquin::planning
