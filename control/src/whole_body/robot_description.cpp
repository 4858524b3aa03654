#include <cmath>

#include "palanquin/control/whole_body/robot_model.hpp"
#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

namespace {

std::string explain_body(const BodyDescription& body, int index) {
  SettingRules rules("body '" + body.name + "': ");
  if (index == 0)
    rules.check(body.parent == -1, "parent", body.parent, "-1, since the first body floats")
        .positive("mass", body.mass);
  else
    rules.check(body.parent >= 0 && body.parent < index, "parent", body.parent, "an earlier body")
        .not_negative("mass", body.mass);
  rules.finite("com", body.com)
      .check(body.inertia.allFinite(), "inertia", body.inertia.reshaped().transpose(), "finite")
      .finite("position", body.position)
      .check(std::abs(body.orientation.norm() - 1) < 1e-6, "orientation",
             body.orientation.transpose(), "a unit quaternion");
  if (!body.axis.isZero())
    rules
        .check(std::abs(body.axis.norm() - 1) < 1e-6, "axis", body.axis.transpose(),
               "of length 1, or 0 for a fixed body")
        .positive("effort", body.effort)
        .not_negative("armature", body.armature)
        .not_negative("damping", body.damping);
  return rules.sentence();
}

}  // namespace

std::string RobotDescription::explain_invalid() const {
  if (bodies.empty()) return "bodies: at least one is needed";
  SettingRules rules;
  for (std::size_t i = 0; i < bodies.size(); ++i)
    rules.nested(explain_body(bodies[i], static_cast<int>(i)));
  for (const PointDescription& point : points)
    rules.nested(SettingRules("point '" + point.name + "': ")
                     .one_of("body", point.body, static_cast<int>(bodies.size()))
                     .finite("position", point.position)
                     .sentence());
  return rules.sentence();
}

bool RobotState::is_finite() const {
  return base_position.allFinite() && base_orientation.allFinite() && base_velocity.allFinite() &&
         base_rate.allFinite() && joint_positions.allFinite() && joint_velocities.allFinite();
}

}  // namespace palanquin
