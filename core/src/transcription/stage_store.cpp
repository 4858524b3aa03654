#include "transcription/stage_store.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <utility>

#include "transcription/roles.hpp"
#include "transcription/sizes.hpp"

namespace palanquin {
namespace {

/// One number for every structure there ever was: QPs of two stores never pass for each other.
std::uint64_t next_revision() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

}  // namespace

StageStore::StageStore(const TranscriptionModel& model)
    : table_(model.problem(), model.exact(), model.links()),
      shapes_(size_of(model.horizon() + 1)),
      rows_(shapes_.size()) {
  qp_.stages.resize(shapes_.size());
}

void StageStore::update(const std::vector<const KnotSignature*>& signatures,
                        const RowPolicies& policies) {
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    shapes_[k] = &table_.find(before(signatures, k), signatures[k], after(signatures, k));
    rows_[k] = shapes_[k];
  }
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    QpStage& stage = qp_.stages[k];
    if (stage.pattern >= 0 && stage.pattern != shapes_[k]->pattern.pattern)
      idle_[stage.pattern].push_back(std::move(stage));
  }
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    QpStage& stage = qp_.stages[k];
    if (stage.pattern == shapes_[k]->pattern.pattern) continue;
    take_on(stage, *shapes_[k], policies);
    qp_.structure_revision = next_revision();
  }
  qp_.initial_state.resize(qp_.stages.front().nx);
}

/// The patterns are those of a stage that had the shape before, so that a moving gait does not
/// allocate, or a copy.
void StageStore::take_on(QpStage& stage, const KnotShape& shape, const RowPolicies& policies) {
  std::vector<QpStage>& idle = idle_[shape.pattern.pattern];
  if (idle.empty()) {
    stage = shape.pattern;
  } else {
    stage = std::move(idle.back());
    idle.pop_back();
  }
  const std::vector<Policy>& of_rows = policies.at(shape.stage).policy;
  for (std::size_t i = 0; i < shape.penalty_rows.size(); ++i)
    stage.penalty_policy[i] = of_rows[size_of(shape.penalty_rows[i])];
}

void StageStore::expire() {
  for (QpStage& stage : qp_.stages) stage.pattern = -1;
}

void StageStore::clear() {
  expire();
  idle_.clear();
  table_.clear();
  std::fill(shapes_.begin(), shapes_.end(), nullptr);
  std::fill(rows_.begin(), rows_.end(), nullptr);
}

}  // namespace palanquin
