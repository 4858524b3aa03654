#pragma once

#include "palanquin/control/planning/local_planner.hpp"

namespace palanquin::planning {

/// Local planners that exchange their solutions over links (Kim et al., Assumption 2).
class DistributedPlanner final : public LayeredPlanner {
 public:
  using Links = std::map<std::pair<int, int>, LinkSettings>;

  /// One problem a robot; settings of links by (sender, receiver), a plain delay of one sample
  /// where there are none. Throws std::invalid_argument for links between robots that share no bar.
  DistributedPlanner(BarTeam team, const LayeredSettings& settings,
                     std::vector<std::shared_ptr<LinearMpc>> problems, Links links = {});

  /// The robots' planners; of them, what their parts of the last plan took.
  const LocalPlanner& local(int robot) const { return locals_.at(static_cast<std::size_t>(robot)); }
  /// By (sender, receiver).
  const std::map<std::pair<int, int>, Link>& links() const { return links_; }

 private:
  void solve(const BarSample& sample, LayeredPlan& plan) override;
  void fall_back(const BarSample& sample, LayeredPlan& plan) const override;
  void greet(const BarSample& sample, const RowMatrix& inputs);
  void solve_locals(const BarSample& sample, const RowMatrix& inputs);
  void collect(LayeredPlan& plan) const;

  std::vector<LocalPlanner> locals_;
  std::map<std::pair<int, int>, Link> links_;
  int step_ = -1;
};

}  // namespace palanquin::planning
