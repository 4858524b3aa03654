#include "palanquin/control/whole_body/robot_description.hpp"

#include <cmath>

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

std::vector<int> RobotDescription::limbs_of(LimbKind kind) const {
  std::vector<int> found;
  for (std::size_t i = 0; i < limbs.size(); ++i)
    if (limbs[i].kind == kind) found.push_back(static_cast<int>(i));
  return found;
}

std::vector<int> RobotDescription::hinges_to(int body) const {
  std::vector<int> hinge_of(bodies.size(), -1);
  int hinges = 0;
  for (std::size_t i = 1; i < bodies.size(); ++i)
    if (!bodies[i].axis.isZero()) hinge_of[i] = hinges++;
  std::vector<int> chain;
  for (; body >= 0; body = bodies[static_cast<std::size_t>(body)].parent)
    if (const int hinge = hinge_of.at(static_cast<std::size_t>(body)); hinge >= 0)
      chain.insert(chain.begin(), hinge);
  return chain;
}

std::string RobotDescription::explain_invalid() const {
  if (bodies.empty()) return "bodies: at least one is needed";
  SettingRules rules;
  for (std::size_t i = 0; i < bodies.size(); ++i)
    rules.nested(explain_body(bodies[i], static_cast<int>(i)));
  for (const LimbDescription& limb : limbs)
    rules.nested(SettingRules("limb '" + limb.name + "': ")
                     .one_of("body", limb.body, static_cast<int>(bodies.size()))
                     .finite("position", limb.position)
                     .not_negative("radius", limb.radius)
                     .sentence());
  return rules.sentence();
}

}  // namespace palanquin
