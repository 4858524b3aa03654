#pragma once

#include <memory>
#include <unordered_map>
#include <vector>

#include "palanquin/core/stage_qp.hpp"
#include "sparse_runs.hpp"

namespace palanquin {

/// Where the entries of a knot's Hessian and penalised rows stand that a PenaltySegment multiplies.
class SegmentPlan {
 public:
  void make(const QpStage& stage);
  /// Whether the plan reads nothing of `stage` out of bounds.
  bool fits(const QpStage& stage) const;

  /// The runs of the penalty Jacobian.
  kernels::SparseRuns rows() const { return rows_.lists(); }
  /// a'Hb
  double bilinear(const SparseBlock& hessian, const double* a, const double* b) const;

 private:
  /// Columns of the Hessian's lower triangle whose diagonal entries stand one after the other.
  struct Diagonal {
    int entry = 0, column = 0, size = 0;
  };
  struct OffDiagonal {
    int entry = 0, row = 0, column = 0;
  };

  SparseRuns rows_;
  std::vector<Diagonal> diagonal_;
  std::vector<OffDiagonal> off_diagonal_;
  int hessian_columns_ = 0, hessian_entries_ = 0, penalty_rows_ = 0;
};

/// The plans of all knots of a StageQp. Those of patterns with an id are kept: a gait moves them
/// along the horizon and brings them back.
class SegmentPlans {
 public:
  void find(const StageQp& qp);
  const SegmentPlan& operator[](std::size_t k) const { return *plans_[k]; }
  /// Plans that are kept by pattern.
  std::size_t size() const { return by_pattern_.size(); }

 private:
  std::vector<const SegmentPlan*> plans_;
  std::unordered_map<int, SegmentPlan> by_pattern_;
  std::vector<std::unique_ptr<SegmentPlan>> by_knot_;  // of patterns without an id
  std::uint64_t revision_ = 0;
};

}  // namespace palanquin
