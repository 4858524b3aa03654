#pragma once

#include <memory>
#include <unordered_map>
#include <vector>

#include "palanquin/core/stage_qp.hpp"
#include "structured/knot_plan.hpp"

namespace palanquin::structured {

/// The plans of all patterns that a solver has met. A gait moves patterns along the horizon and
/// brings them back: a pattern with an id (QpStage::pattern) is planned once.
class PlanStore {
 public:
  /// Makes room for the knots of `qp`; call before find. Plans that were found before are void.
  void start(const StageQp& qp);
  /// The plan of knot k. Throws std::invalid_argument, naming knot and block, if a block does not
  /// fit its knot.
  const KnotPlan& find(const StageQp& qp, int k);
  /// Plans that are kept by pattern.
  std::size_t size() const { return by_pattern_.size(); }

 private:
  KnotPlanner planner_;
  std::unordered_map<int, std::unique_ptr<KnotPlan>> by_pattern_;
  std::vector<std::unique_ptr<KnotPlan>> by_knot_;  // of patterns without an id
  PlanCapacity capacity_;                           // of the plans by knot
};

/// Throws std::invalid_argument, naming knot and block, if dimensions contradict each other.
void check_dimensions(const StageQp& qp, int k);

}  // namespace palanquin::structured
