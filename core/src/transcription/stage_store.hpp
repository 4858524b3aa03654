#pragma once

#include <unordered_map>
#include <vector>

#include "palanquin/core/transcription/inputs.hpp"
#include "palanquin/core/transcription/knot_shape.hpp"
#include "palanquin/core/transcription/model.hpp"

namespace palanquin {

/// The stages of a StageQp in the shapes that roles and flags give its knots.
class StageStore {
 public:
  explicit StageStore(const TranscriptionModel& model);

  /// Gives every stage whose knot has another shape now the patterns of that.
  void update(const std::vector<const KnotSignature*>& signatures, const RowPolicies& policies);
  /// Stages copy their rows' policies when they take on a shape: all of them will anew.
  void expire();

  StageQp& qp() { return qp_; }
  const StageQp& qp() const { return qp_; }
  QpStage& stage(int knot) { return qp_.stages[static_cast<std::size_t>(knot)]; }
  const KnotShape& shape(int knot) const { return *shapes_[static_cast<std::size_t>(knot)]; }
  /// Of every knot, its shape's.
  const std::vector<const KnotRows*>& rows() const { return rows_; }

  /// Shapes that are kept.
  std::size_t size() const { return table_.size(); }
  /// Forgets them; shape() and rows() are void until the next update.
  void clear();

 private:
  void take_on(QpStage& stage, const KnotShape& shape, const RowPolicies& policies);

  ShapeTable table_;
  std::vector<const KnotShape*> shapes_;
  std::vector<const KnotRows*> rows_;
  StageQp qp_;
  std::unordered_map<int, std::vector<QpStage>> idle_;  // by pattern, stages that no knot has now
};

}  // namespace palanquin
