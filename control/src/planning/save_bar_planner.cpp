#include <array>
#include <stdexcept>

#include "palanquin/control/planning/bar_planner_file.hpp"
#include "palanquin/control/planning/distributed_planner.hpp"
#include "palanquin/control/planning/planner_text.hpp"
#include "palanquin/control/planning/sqp_settings_text.hpp"

namespace palanquin::planning {

namespace {

using palanquin::to_text;

std::string kind(const LayeredPlanner& planner) {
  const LayeredSettings& s = planner.settings();
  const auto* distributed = dynamic_cast<const DistributedPlanner*>(&planner);
  if (distributed == nullptr) return "kind centralized " + to_text(s.dt) + '\n';
  std::string text = "kind distributed " + to_text(s.dt) + "\nexchange " +
                     (s.dual_terms ? "1 " : "0 ") + std::to_string(s.exchanges) + '\n';
  for (const auto& [ends, link] : distributed->links()) {
    const LinkSettings& l = link.settings();
    text += "link " + std::to_string(ends.first) + ' ' + std::to_string(ends.second) + ' ' +
            std::to_string(l.delay) + words(std::array{l.loss, l.bias}) + ' ' +
            std::to_string(l.bias_from) + ' ' + std::to_string(l.seed) + '\n';
  }
  return text;
}

std::string leash(const Leash& leash) {
  const char* shape = leash.shape == Leash::Shape::Circle ? "circle " : "square ";
  return std::string("leash ") + shape + to_text(leash.length) + '\n';
}

std::string team(const BarTeam& team) {
  std::string text;
  for (const double mass : team.masses) text += "robot " + to_text(mass) + '\n';
  for (const Bar& bar : team.bars)
    text += "bar " + std::to_string(bar.robots[0]) + ' ' + std::to_string(bar.robots[1]) + ' ' +
            std::to_string(bar.rows) + '\n';
  return text;
}

}  // namespace

void save_bar_planner(const BarPlanner& planner, const std::vector<std::string>& problems,
                      const std::string& folder) {
  const LayeredPlanner& layered = planner.planner();
  if (problems.size() != layered.problems().size())
    throw std::runtime_error("a folder for each of the planner's problems is needed");
  std::string text = "bar_planner 1\n" + kind(layered) + leash(planner.leash()) +
                     team(layered.team()) +
                     planning::to_text(layered.problems().front()->sqp().settings());
  for (std::size_t i = 0; i < problems.size(); ++i) {
    const LinearMpc& mpc = *layered.problems()[i];
    text += "problem " + problems[i] + ' ' + std::to_string(mpc.horizon()) + '\n' +
            parameters_text(mpc.problem(), mpc.parameters);
  }
  write_planner_text(folder, text);
}

}  // namespace palanquin::planning
