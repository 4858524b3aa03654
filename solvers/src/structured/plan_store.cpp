#include "structured/plan_store.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "palanquin/core/most_kept.hpp"

namespace palanquin::structured {

void PlanStore::start(const StageQp& qp) {
  if (qp.stages.empty()) throw std::invalid_argument("StageQp: stages is empty");
  if (by_pattern_.size() > most_kept(qp.stages.size())) by_pattern_.clear();
  while (by_knot_.size() < qp.stages.size()) by_knot_.push_back(std::make_unique<KnotPlan>());
  capacity_ = {};
  for (const QpStage& stage : qp.stages)
    if (stage.pattern < 0) capacity_.include(stage);
}

const KnotPlan& PlanStore::find(const StageQp& qp, int k) {
  const QpStage& stage = qp.stages[k];
  if (stage.pattern < 0) {
    check_dimensions(qp, k);
    KnotPlan& plan = *by_knot_[k];
    capacity_.apply(plan);
    planner_.plan(stage, plan);
    return plan;
  }
  if (const auto known = by_pattern_.find(stage.pattern); known != by_pattern_.end()) {
    if (!known->second->fits(stage))
      throw std::invalid_argument(
          "StageQp: knot " + std::to_string(k) + ": pattern " + std::to_string(stage.pattern) +
          " had other dimensions before; equal ids must mean equal patterns");
    return *known->second;
  }
  check_dimensions(qp, k);
  auto plan = std::make_unique<KnotPlan>();
  planner_.plan(stage, *plan);
  return *by_pattern_.emplace(stage.pattern, std::move(plan)).first->second;
}

}  // namespace palanquin::structured
