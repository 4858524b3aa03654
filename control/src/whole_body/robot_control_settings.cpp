#include "palanquin/control/whole_body/robot_controller.hpp"
#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

std::string RobotControlSettings::explain_invalid() const {
  SettingRules rules;
  rules.nested("whole_body: ", whole_body.explain_invalid())
      .nested("gait: ", gait.explain_invalid())
      .finite("gait_start", gait_start)
      .nested("contact: ", contact.explain_invalid())
      .not_negative("friction", friction)
      .not_negative("least_force", least_force)
      .check(least_force <= whole_body.largest_force, "least_force", least_force,
             "at most whole_body.largest_force")
      .not_negative("loaded_after", loaded_after)
      .not_negative("swing_clearance", swing_clearance)
      .not_negative("foothold_gain", foothold_gain)
      .not_negative("reach_speed", reach_speed)
      .not_negative("reach_depth", reach_depth)
      .not_negative("penetration", penetration);
  for (std::size_t i = 0; i < posture.size(); ++i)
    rules.at_least(entry("posture", i), posture[i], 0);
  return rules.sentence();
}

}  // namespace palanquin
