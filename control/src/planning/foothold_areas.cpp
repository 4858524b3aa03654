#include "palanquin/control/planning/foothold_areas.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace palanquin::planning {

namespace {
constexpr double kCell = 0.05;        // of the grid that says which areas are near, m
constexpr int kNear = Offers::kMost;  // so many

/// By how much a point misses an area's worst half-space, m; at most 0 inside.
double missed(const FootholdArea& area, double x, double y) {
  double worst = -std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 0; i < area.half_spaces.rows(); ++i) {
    const auto line = area.half_spaces.row(i);
    worst = std::max(worst, line[0] * x + line[1] * y + line[2]);
  }
  return worst;
}

double height_of(const FootholdArea& area, double x, double y) {
  return area.plane[0] + area.plane[1] * x + area.plane[2] * y;
}
}  // namespace

FootholdAreas::FootholdAreas(std::vector<FootholdArea> areas, const Vector2& low,
                             const Vector2& high, std::shared_ptr<const Terrain> trend)
    : areas_(std::move(areas)), trend_(std::move(trend)), least_(low), most_(high) {
  if (areas_.empty())
    throw std::invalid_argument("areas: there is none; feet must stand somewhere");
  for (const FootholdArea& area : areas_)
    if (area.half_spaces.cols() != 3 || area.corners.cols() != 2 || area.corners.rows() < 1 ||
        area.half_spaces.rows() != areas_.front().half_spaces.rows())
      throw std::invalid_argument("areas: half-spaces are [sides, 3] and corners [n, 2]");
  build_lookup(low, high);
}

/// At each point of a grid the areas missed by least.
void FootholdAreas::build_lookup(const Vector2& low, const Vector2& high) {
  low_ = low.array() - kCell;
  const auto points = [](double extent) { return static_cast<int>(std::ceil(extent / kCell)); };
  nx_ = points(high.x() + 2 * kCell - low_.x());
  ny_ = points(high.y() + 2 * kCell - low_.y());
  const int areas = static_cast<int>(areas_.size());
  count_ = std::min(kNear, areas);
  lookup_.reserve(static_cast<std::size_t>(nx_) * ny_ * count_);
  std::vector<int> order(areas_.size());
  std::vector<double> by(areas_.size());
  for (int i = 0; i < nx_; ++i)
    for (int j = 0; j < ny_; ++j) {
      for (int a = 0; a < areas; ++a)
        by[a] = missed(areas_[a], low_.x() + kCell * i, low_.y() + kCell * j);
      std::iota(order.begin(), order.end(), 0);
      std::partial_sort(order.begin(), order.begin() + count_, order.end(),
                        [&](int a, int b) { return by[a] != by[b] ? by[a] < by[b] : a < b; });
      lookup_.insert(lookup_.end(), order.begin(), order.begin() + count_);
    }
}

std::span<const int> FootholdAreas::near(double x, double y) const {
  const auto cell = [](double distance, int size) {
    return static_cast<std::size_t>(std::clamp(std::nearbyint(distance / kCell), 0.0, size - 1.0));
  };
  const std::size_t at = cell(x - low_.x(), nx_) * ny_ + cell(y - low_.y(), ny_);
  return {&lookup_[at * count_], static_cast<std::size_t>(count_)};
}

double FootholdAreas::excess(double x, double y) const {
  double least = std::numeric_limits<double>::infinity();
  for (const int a : near(x, y)) least = std::min(least, missed(areas_[a], x, y));
  return least;
}

double FootholdAreas::height(double x, double y) const {
  const double least = std::max(excess(x, y), 0.0);
  double highest = -std::numeric_limits<double>::infinity();
  for (const int a : near(x, y))
    if (std::max(missed(areas_[a], x, y), 0.0) <= least)
      highest = std::max(highest, height_of(areas_[a], x, y));
  return highest;
}

Vector2 FootholdAreas::slope(double x, double y) const {
  return chosen({x, y, height(x, y)}).plane.tail<2>();
}

const FootholdArea& FootholdAreas::chosen(const Vector3& p) const {
  const FootholdArea* best = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const int a : near(p.x(), p.y())) {
    const FootholdArea& area = areas_[a];
    const double distance =
        std::max(missed(area, p.x(), p.y()), 0.0) + std::abs(p.z() - height_of(area, p.x(), p.y()));
    if (best == nullptr || distance < least) {
      best = &area;
      least = distance;
    }
  }
  return *best;
}

std::vector<LocalParameter> FootholdAreas::local_parameters() const {
  return {{"sides", static_cast<int>(areas_.front().half_spaces.size())}, {"plane", 3}};
}

void FootholdAreas::around(const Vector3& foothold, double* values) const {
  const FootholdArea& area = chosen(foothold);
  std::copy_n(area.half_spaces.data(), area.half_spaces.size(), values);
  std::copy_n(area.plane.data(), 3, values + area.half_spaces.size());
}

Offers FootholdAreas::options(const Vector3& wanted) const {
  Offers offers;
  std::array<double, kNear> distances{};
  for (const int a : near(wanted.x(), wanted.y())) {
    const Vector2 p = nearest_in_polygon(areas_[a].corners, wanted.head<2>());
    const double distance = (p - wanted.head<2>()).norm();
    int at = offers.count++;  // insertion keeps the order of equals
    for (; at > 0 && distances[at - 1] > distance; --at) {
      distances[at] = distances[at - 1];
      offers.points[at] = offers.points[at - 1];
    }
    distances[at] = distance;
    offers.points[at] << p, height_of(areas_[a], p.x(), p.y());
  }
  return offers;
}

Vector2 nearest_in_polygon(const RowMatrix& corners, const Vector2& p) {
  bool is_inside = true;
  double least = std::numeric_limits<double>::infinity();
  Vector2 nearest = p;
  for (Eigen::Index i = 0; i < corners.rows(); ++i) {
    const Vector2 corner = corners.row(i);
    const Vector2 side = corners.row((i + 1) % corners.rows()).transpose() - corner;
    const Vector2 from = p - corner;
    is_inside = is_inside && side.x() * from.y() - side.y() * from.x() >= 0.0;
    const double length = std::max(side.squaredNorm(), std::numeric_limits<double>::min());
    const Vector2 on_side = corner + std::clamp(from.dot(side) / length, 0.0, 1.0) * side;
    const double distance = (on_side - p).norm();
    if (distance < least) {
      least = distance;
      nearest = on_side;
    }
  }
  return is_inside ? p : nearest;
}

}  // namespace palanquin::planning
