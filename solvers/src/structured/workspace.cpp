#include "structured/workspace.hpp"

#include <algorithm>
#include <utility>

namespace palanquin::structured {

using kernels::padded;

/// Runs are read and added to by whole vectors, which may reach over the end.
constexpr std::size_t kOverhang = kernels::kPad;

bool Workspace::is_analyzed(const StageQp& qp) const {
  if (knots.size() != qp.stages.size() || revision_ != qp.structure_revision) return false;
  // A revision is the caller's word; sizes that contradict it would be read out of bounds.
  for (std::size_t k = 0; k < knots.size(); ++k) {
    const KnotPlan& plan = knots[k].plan;
    const QpStage& stage = qp.stages[k];
    if (plan.nx != stage.nx || plan.nu != stage.nu || plan.nl != stage.nl ||
        static_cast<int>(plan.local_hessian.size() + plan.hessian.size()) != stage.hessian.nnz() ||
        plan.penalty.rows() != stage.penalty_jacobian.rows ||
        static_cast<int>(plan.penalty.slot.size()) != stage.penalty_jacobian.nnz() ||
        plan.equality.rows() != stage.equality_jacobian.rows ||
        static_cast<int>(plan.equality.slot.size()) != stage.equality_jacobian.nnz())
      return false;
  }
  return true;
}

void Workspace::analyze(const StageQp& qp) {
  factorized = nullptr;
  check_dimensions(qp);
  knots.resize(qp.stages.size());
  MemorySizes sizes;
  PlanCapacity capacity;
  for (const QpStage& stage : qp.stages) {
    sizes.include(lay_out(stage), stage.equality_jacobian.rows);
    capacity.include(stage);
  }
  has_equality_rows = sizes.equality_rows > 0;
  hand_out_matrices(sizes);
  int local_factor = 0;
  for (std::size_t k = 0; k < knots.size(); ++k) {
    KnotPlan& plan = knots[k].plan;
    capacity.apply(plan);
    double* matrices = matrices_.data() + k * (sizes.panel + sizes.value);
    planner_.plan(qp.stages[k], {locals.data(), matrices, matrices + sizes.panel}, plan);
    // Unit pivots behind the last input, see kernels::Table::partial_cholesky.
    for (int j = plan.nu; j < padded(plan.nu); ++j) matrices[j * (plan.panel_ld + 1)] = 1.0;
    local_factor = std::max(local_factor, plan.local_factor_size);
  }
  scratch.reserve(kernels::kPad * std::max(capacity.penalty.entries, capacity.equality.entries));
  hand_out_vectors(sizes, local_factor);
  flops = count_flops(qp, knots);
  revision_ = qp.structure_revision;
}

void MemorySizes::include(const KnotLayout& layout, int equalities) {
  const auto raise = [](std::size_t& most, int size) {
    most = std::max(most, static_cast<std::size_t>(size));
  };
  raise(panel, layout.panel_size());
  raise(value, layout.value_size());
  raise(panel_ld, layout.panel_ld);
  raise(value_ld, layout.value_ld);
  raise(slots, layout.slots());
  raise(locals, layout.nl);
  raise(equality_rows, padded(equalities));
}

void Workspace::hand_out_matrices(const MemorySizes& sizes) {
  const std::size_t size = knots.size() * (sizes.panel + sizes.value) + kOverhang;
  matrices_.reserve(size);
  std::fill_n(matrices_.data(), size, 0.0);
  value.reserve(sizes.value_ld * sizes.value_ld);
  product.reserve(sizes.panel_ld * sizes.value_ld);
  slope.reserve(sizes.value_ld);
  gradient.reserve(sizes.slots + kOverhang);
  locals.reserve(sizes.locals * (sizes.slots + kOverhang));
}

void Workspace::clear() {
  factorized = nullptr;
  knots.clear();  // what an analysis has written into the matrices goes with them
  for (AlignedBuffer* buffer :
       {&matrices_, &vectors_, &value, &product, &slope, &gradient, &locals, &scratch})
    buffer->clear();
}

void Workspace::hand_out_vectors(const MemorySizes& sizes, int local_factor) {
  const std::size_t factor = padded(local_factor);
  const std::size_t share = factor + sizes.slots + sizes.value_ld;
  const std::size_t equality_share = 3 * sizes.equality_rows + sizes.slots + sizes.value_ld;
  const std::size_t size = knots.size() * (share + (has_equality_rows ? equality_share : 0));
  vectors_.reserve(size + kOverhang);
  std::fill_n(vectors_.data(), size + kOverhang, 0.0);
  double* next = vectors_.data();
  const auto take = [&](std::size_t count) { return std::exchange(next, next + count); };
  for (Knot& knot : knots) {
    knot.local_factor = take(factor);
    knot.z = take(sizes.slots);
    knot.multiplier = take(sizes.value_ld);
    if (!has_equality_rows) continue;
    knot.equality_stiffness = take(sizes.equality_rows);
    knot.equality_multiplier = take(sizes.equality_rows);
    knot.equality_residual = take(sizes.equality_rows);
    knot.correction = take(sizes.slots);
    knot.value_correction = take(sizes.value_ld);
  }
}

}  // namespace palanquin::structured
