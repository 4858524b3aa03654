#include "palanquin/sim/disturbance.hpp"

#include <cmath>
#include <numbers>

namespace palanquin {

Vector3 Push::force(double time) const {
  if (time < start || time >= end) return Vector3::Zero();
  const Eigen::Array3d angle =
      2 * std::numbers::pi * (time - start) / period.array() + phase.array();
  return amplitude.array() * angle.sin();
}

Vector3 Tether::force(double time, const Vector3& position, const Vector3& point_velocity) const {
  if (time < start || time >= end) return Vector3::Zero();
  const Vector3 rope = anchor + (time - start) * velocity - position;
  const double length = rope.norm();
  if (length <= slack || length == 0) return Vector3::Zero();
  const Vector3 direction = rope / length;
  const double rate = direction.dot(velocity - point_velocity);
  return std::max(0.0, stiffness * (length - slack) + damping * rate) * direction;
}

namespace {

std::string explain(const Push& push) {
  if (!push.amplitude.allFinite() || !push.phase.allFinite())
    return "amplitude and phase must be finite";
  return (push.period.array() > 0).all() ? "" : "period must be positive on each axis";
}

std::string explain(const Tether& tether) {
  if (!tether.anchor.allFinite() || !tether.velocity.allFinite())
    return "anchor and velocity must be finite";
  const double least = std::min({tether.slack, tether.stiffness, tether.damping});
  return least >= 0 ? "" : "slack, stiffness and damping must not be negative";
}

}  // namespace

std::string explain_invalid(const Disturbance& disturbance, int bodies) {
  return std::visit(
      [bodies](const auto& d) -> std::string {
        if (d.body < 1 || d.body >= bodies)
          return "disturbance: body " + std::to_string(d.body) + " does not exist";
        if (!d.point.allFinite()) return "disturbance: point must be finite";
        if (!(d.end >= d.start)) return "disturbance: end must not be before start";
        if (auto text = explain(d); !text.empty()) return "disturbance: " + text;
        return {};
      },
      disturbance);
}

}  // namespace palanquin
