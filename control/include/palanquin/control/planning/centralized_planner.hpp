#pragma once

#include "palanquin/control/planning/layered_planner.hpp"

namespace palanquin::planning {

/// One QP over all robots and bars (16); of a team without bars, the nominal planner.
class CentralizedPlanner final : public LayeredPlanner {
 public:
  /// The problem has blocks robot1.*, robot2.*, ... and bar1.lambda, ...; throws
  /// std::invalid_argument that names what it lacks.
  CentralizedPlanner(BarTeam team, const LayeredSettings& settings, std::shared_ptr<LinearMpc> mpc);

  /// Puts operating point, parameters and references of a sample into the problem.
  void linearize_at(const BarSample& sample);

 private:
  void solve(const BarSample& sample, LayeredPlan& plan) override;

  std::vector<BarRobotSlots> robots_;
  std::vector<int> multipliers_;  ///< [bars]
};

}  // namespace palanquin::planning
