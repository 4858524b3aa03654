#include "palanquin/plant/disturbance.hpp"

#include <cmath>
#include <numbers>

#include "palanquin/core/setting_rules.hpp"

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
  return SettingRules()
      .finite("amplitude", push.amplitude)
      .finite("phase", push.phase)
      .check((push.period.array() > 0).all(), "period", push.period.transpose(),
             "positive on each axis")
      .sentence();
}

std::string explain(const Tether& tether) {
  return SettingRules()
      .finite("anchor", tether.anchor)
      .finite("velocity", tether.velocity)
      .not_negative("slack", tether.slack)
      .not_negative("stiffness", tether.stiffness)
      .not_negative("damping", tether.damping)
      .sentence();
}

}  // namespace

std::string explain_invalid(const Disturbance& disturbance, int bodies) {
  return std::visit(
      [bodies](const auto& d) {
        return SettingRules("disturbance.")
            .one_of("body", d.body, bodies, 1)
            .finite("point", d.point)
            .finite("start", d.start)
            .check(d.end >= d.start, "end", d.end, "at least start")
            .nested("disturbance.", explain(d))
            .sentence();
      },
      disturbance);
}

}  // namespace palanquin
