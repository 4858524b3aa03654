#include "segment_plan.hpp"

#include "palanquin/core/most_kept.hpp"

namespace palanquin {

void SegmentPlan::make(const QpStage& stage) {
  rows_.make(stage.penalty_jacobian);
  const SparseBlock& h = stage.hessian;
  diagonal_.clear();
  off_diagonal_.clear();
  for (int j = 0; j < h.cols; ++j) {
    int e = h.column_start[j];  // of the diagonal, which leads its column
    if (j == 0 || e > h.column_start[j - 1] + 1) diagonal_.push_back({e, j, 0});
    ++diagonal_.back().size;
    while (++e < h.column_start[j + 1]) off_diagonal_.push_back({e, h.row_index[e], j});
  }
  hessian_columns_ = h.cols;
  hessian_entries_ = h.nnz();
  penalty_rows_ = stage.penalty_jacobian.rows;
}

bool SegmentPlan::fits(const QpStage& stage) const {
  return hessian_columns_ == stage.hessian.cols && hessian_entries_ == stage.hessian.nnz() &&
         penalty_rows_ == stage.penalty_jacobian.rows &&
         rows_.entries() == stage.penalty_jacobian.nnz();
}

double SegmentPlan::bilinear(const SparseBlock& hessian, const double* a, const double* b) const {
  using Values = Eigen::Map<const Eigen::ArrayXd>;
  const double* values = hessian.values.data();
  double sum = 0.0;
  for (const auto& [e, j, size] : diagonal_)
    sum += (Values(values + e, size) * Values(a + j, size) * Values(b + j, size)).sum();
  for (const auto& [e, i, j] : off_diagonal_) sum += values[e] * (a[i] * b[j] + a[j] * b[i]);
  return sum;
}

void SegmentPlans::find(const StageQp& qp) {
  const std::size_t count = qp.stages.size();
  const bool is_known = revision_ == qp.structure_revision && plans_.size() == count;
  if (by_pattern_.size() > most_kept(count)) by_pattern_.clear();
  plans_.resize(count);
  while (by_knot_.size() < count) by_knot_.push_back(std::make_unique<SegmentPlan>());
  for (std::size_t k = 0; k < count; ++k) {
    const QpStage& stage = qp.stages[k];
    if (stage.pattern < 0) {
      plans_[k] = by_knot_[k].get();
      if (!is_known || !plans_[k]->fits(stage)) by_knot_[k]->make(stage);
    } else {
      const auto [plan, is_new] = by_pattern_.try_emplace(stage.pattern);
      if (is_new || !plan->second.fits(stage)) plan->second.make(stage);
      plans_[k] = &plan->second;
    }
  }
  revision_ = qp.structure_revision;
}

}  // namespace palanquin
