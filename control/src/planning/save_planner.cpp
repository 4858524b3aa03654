#include "palanquin/control/planning/planner_file.hpp"
#include "palanquin/control/planning/planner_text.hpp"
#include "palanquin/control/planning/sqp_settings_text.hpp"

namespace palanquin::planning {

namespace {

using palanquin::to_text;

std::string rules(const TeamPlanner& planner) {
  const PlannerSettings& s = planner.settings();
  const char* footholds = s.footholds == FootholdRule::Hips ? " hips" : " raibert";
  const char* references = s.references == RobotReferences::Rigid ? " rigid " : " ground ";
  return std::string("rules") + footholds + references + std::to_string(s.restart_after) + ' ' +
         std::to_string(planner.candidates()) + ' ' + std::to_string(s.threads) + '\n';
}

std::string observers(const ObserverSettings& settings) {
  if (!settings.is_on()) return "";
  std::string text = "observers";
  for (const ObserverGains& g : {settings.robots, settings.payload})
    text += words(std::array{g.force, g.most_force, g.torque, g.most_torque});
  return text + '\n';
}

std::string robot(const Carrier& c) {
  std::string text = "robot " + c.name + ' ' + to_text(c.mass) + ' ' + to_text(c.standing_height) +
                     ' ' + to_text(c.yaw) + "\ngrasp" + words(c.attach) + words(c.hand) + "\nhips";
  for (const Vector3& hip : c.hips) text += words(hip);
  std::string name = c.gait.name.empty() ? "gait" : c.gait.name;
  for (char& letter : name)
    if (letter == ' ') letter = '_';
  std::array<double, kFeet> duty{}, offset{};
  for (std::size_t f = 0; f < kFeet; ++f) {
    duty[f] = c.gait.duty_of(static_cast<int>(f));
    offset[f] = f < c.gait.offset.size() ? c.gait.offset[f] : 0.0;
  }
  return text + "\ngait " + name + ' ' + to_text(c.gait.period) + words(duty) + words(offset) +
         '\n';
}

std::string policy(const std::string& family, const Policy& p) {
  constexpr const char* kKinds[] = {" hard ", " c2_penalty ", " squared_hinge ",
                                    " relaxed_barrier "};
  return "policy " + family + kKinds[static_cast<int>(p.kind)] + to_text(p.stiffness) + ' ' +
         to_text(p.smoothing) + '\n';
}

}  // namespace

void save_planner(const TeamPlanner& planner, const std::map<std::string, Policy>& policies,
                  const std::string& folder) {
  std::string text = "planner 1\nhorizon " + std::to_string(planner.horizon()) + '\n';
  text += rules(planner) + observers(planner.settings().observers);
  const Team& team = planner.team();
  text += "payload " + to_text(team.payload.mass) + ' ' + to_text(team.payload.height) + '\n';
  text +=
      std::string("feet_below ") + (team.feet_below == FeetBelow::Hips ? "hips" : "load") + '\n';
  for (const Carrier& carrier : team.carriers) text += robot(carrier);
  planner.ground().terrain().write(text, folder);
  const RowMatrix& ditches = planner.ground().ditches().lines();
  for (Eigen::Index i = 0; i < ditches.rows(); ++i) text += "ditch" + words(ditches.row(i)) + '\n';
  text += planning::to_text(planner.solver().settings());
  for (const auto& [family, p] : policies) text += policy(family, p);
  text += parameters_text(planner.problem(), planner.parameters(),
                          [&](int offset) { return planner.slots().is_written(offset); });
  write_planner_text(folder, text);
}

}  // namespace palanquin::planning
