#include "palanquin/control/whole_body/whole_body_controller.hpp"
#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

std::string WholeBodySettings::explain_invalid() const {
  SettingRules rules;
  rules.positive("torque_weight", torque_weight)
      .positive("force_weight", force_weight)
      .positive("moment_weight", moment_weight)
      .positive("largest_force", largest_force)
      .not_negative("contact_damping", contact_damping)
      .at_least("hold_periods", hold_periods, 0);
  for (const auto& [name, task] : {std::pair{"com", com},
                                   {"orientation", orientation},
                                   {"foot", foot},
                                   {"hand", hand},
                                   {"limb_orientation", limb_orientation},
                                   {"joint", joint}})
    rules.not_negative(std::string(name) + ".kp", task.kp)
        .not_negative(std::string(name) + ".kd", task.kd)
        .positive(std::string(name) + ".weight", task.weight);
  return rules.sentence();
}

}  // namespace palanquin
