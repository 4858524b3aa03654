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
  MemorySizes sizes;
  PlanCapacity capacity;
  for (const QpStage& stage : qp.stages) {
    sizes.include(lay_out(stage), stage.equality_jacobian.rows);
    capacity.include(stage);
  }
  scratch.reserve(kernels::kPad * std::max(capacity.penalty.entries, capacity.equality.entries));
  revision_ = qp.structure_revision;
  if (move_plans(qp, sizes)) return;

  knots.resize(qp.stages.size());
  sizes_ = sizes;
  has_equality_rows = sizes.equality_rows > 0;
  hand_out_matrices(sizes);
  local_factor_ = 0;
  for (std::size_t k = 0; k < knots.size(); ++k) {
    capacity.apply(knots[k].plan);
    double* matrices = matrices_.data() + k * (sizes.panel + sizes.value);
    plan(qp.stages[k], {locals.data(), matrices, matrices + sizes.panel}, knots[k]);
    local_factor_ = std::max(local_factor_, knots[k].plan.local_factor_size);
  }
  hand_out_vectors(sizes, local_factor_);
}

void Workspace::plan(const QpStage& stage, const KnotColumns& columns, Knot& knot) {
  planner_.plan(stage, columns, knot.plan);
  knot.pattern = stage.pattern;
  // Unit pivots behind the last input, see kernels::Table::partial_cholesky.
  for (int j = knot.plan.nu; j < padded(knot.plan.nu); ++j)
    columns.panel[j * (knot.plan.panel_ld + 1)] = 1.0;
}

/// What a gait that moves along the horizon needs: a pattern that stood at another knot keeps its
/// plan and memory and moves with them, and only patterns that are new are planned. False when the
/// memory does not suffice or knots do not say what pattern they have.
bool Workspace::move_plans(const StageQp& qp, const MemorySizes& sizes) {
  const auto pattern = [&](std::size_t k) { return qp.stages[k].pattern; };
  if (knots.size() != qp.stages.size() || !sizes.fit_into(sizes_)) return false;
  if (has_equality_rows || sizes.equality_rows > 0) return false;
  for (std::size_t k = 0; k < knots.size(); ++k)
    if (pattern(k) < 0 || knots[k].pattern < 0) return false;

  for (std::size_t k = 0; k < knots.size(); ++k)
    for (std::size_t j = 0; j < knots.size() && knots[k].pattern != pattern(k); ++j)
      if (knots[j].pattern == pattern(k) && pattern(j) != pattern(k)) std::swap(knots[k], knots[j]);

  for (std::size_t k = 0; k < knots.size(); ++k) {
    Knot& knot = knots[k];
    if (knot.pattern == pattern(k)) continue;
    const KnotColumns columns = knot.plan.columns;
    std::fill_n(columns.panel, sizes_.panel + sizes_.value, 0.0);
    std::fill_n(knot.z, sizes_.slots, 0.0);
    std::fill_n(knot.multiplier, sizes_.value_ld, 0.0);
    plan(qp.stages[k], columns, knot);
    if (knot.plan.local_factor_size > local_factor_) return false;
  }
  return true;
}

bool MemorySizes::fit_into(const MemorySizes& other) const {
  return panel <= other.panel && value <= other.value && panel_ld <= other.panel_ld &&
         value_ld <= other.value_ld && slots <= other.slots && locals <= other.locals &&
         equality_rows <= other.equality_rows;
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
