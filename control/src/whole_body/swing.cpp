#include "palanquin/control/whole_body/swing.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace palanquin {

namespace {

constexpr double kGravity = 9.81;  ///< m/s^2

struct Value {
  double value, slope, curvature;
};

/// A Bezier polynomial and its derivatives at s in [0, 1], by de Casteljau's algorithm.
template <std::size_t count>
Value bezier(std::array<double, count> points, double s) {
  constexpr double degree = count - 1;
  for (std::size_t left = count - 1; left > 2; --left)
    for (std::size_t i = 0; i < left; ++i) points[i] += s * (points[i + 1] - points[i]);
  const double a = points[0] + s * (points[1] - points[0]);
  const double b = points[1] + s * (points[2] - points[1]);
  return {a + s * (b - a), degree * (b - a),
          degree * (degree - 1) * (points[2] - 2 * points[1] + points[0])};
}

}  // namespace

PointTarget swing_target(const Vector3& lift_off, const Vector3& foothold, double clearance,
                         double progress, double duration) {
  const double s = std::clamp(progress, 0.0, 1.0);
  PointTarget target;
  const auto set = [&](int axis, const Value& v) {
    target.position[axis] = v.value;
    target.velocity[axis] = v.slope / duration;
    target.acceleration[axis] = v.curvature / (duration * duration);
  };
  for (const int axis : {0, 1}) {
    const double a = lift_off[axis], b = foothold[axis];
    set(axis, bezier<6>({a, a, a, b, b, b}, s));
  }
  // At s = 1/2 the ends weigh 22/64 each and the middle point 20/64.
  const double a = lift_off.z(), b = foothold.z(), apex = std::max(a, b) + clearance;
  const double middle = (64 * apex - 22 * (a + b)) / 20;
  set(2, bezier<7>({a, a, a, middle, b, b, b}, s));
  return target;
}

Vector3 raibert_foothold(const FootholdInput& input) {
  const double a = input.stance_duration / 2 * std::sqrt(kGravity / std::max(input.height, 0.05));
  const Vector3 hip = input.hip + input.remaining * input.velocity;
  const Vector3 mean = std::tanh(a) / a * input.velocity;
  Eigen::Vector2d ahead =
      (0.5 * input.stance_duration * mean + input.velocity_gain * (mean - input.commanded_velocity))
          .head<2>();
  if (const double length = ahead.norm(); length > input.farthest) ahead *= input.farthest / length;
  return {hip.x() + ahead.x(), hip.y() + ahead.y(), input.ground};
}

}  // namespace palanquin
