#include "structured/workspace.hpp"

#include <algorithm>
#include <utility>

namespace palanquin::structured {
namespace {

using kernels::padded;

/// Runs are read and added to by whole vectors, which may reach over the end.
constexpr std::size_t kOverhang = kernels::kPad;

/// All that kernels expect in a knot's memory and no step writes: unit pivots behind the last
/// input, see kernels::Table::partial_cholesky.
void write_unit_pivots(const Knot& knot) {
  const KnotPlan& plan = *knot.plan;
  for (int j = plan.nu; j < padded(plan.nu); ++j) {
    double* column = knot.panel + j * plan.panel_ld;
    std::fill_n(column, plan.panel_ld, 0.0);
    column[j] = 1.0;
  }
}

}  // namespace

bool Workspace::is_analyzed(const StageQp& qp) const {
  if (!is_analyzed_ || knots.size() != qp.stages.size() || revision_ != qp.structure_revision)
    return false;
  // A revision is the caller's word; sizes that contradict it would be read out of bounds.
  for (std::size_t k = 0; k < knots.size(); ++k)
    if (knots[k].pattern != qp.stages[k].pattern || !knots[k].plan->fits(qp.stages[k]))
      return false;
  return true;
}

void Workspace::analyze(const StageQp& qp) {
  factorized = nullptr;
  is_analyzed_ = false;
  plans_.start(qp);
  const bool is_longer = knots.size() != qp.stages.size();
  knots.resize(qp.stages.size());
  MemorySizes sizes = sizes_;
  has_equality_rows = false;
  for (int k = 0; k <= qp.horizon(); ++k) {
    const KnotPlan& plan = plans_.find(qp, k);
    knots[k].plan = &plan;
    knots[k].pattern = qp.stages[k].pattern;
    sizes.include(plan);
    has_equality_rows = has_equality_rows || plan.equality.rows() > 0;
  }
  if (is_longer || sizes != sizes_) hand_out_memory(sizes);
  for (const Knot& knot : knots) write_unit_pivots(knot);
  revision_ = qp.structure_revision;
  is_analyzed_ = true;
}

void MemorySizes::include(const KnotPlan& plan) {
  const auto size = [](auto count) { return static_cast<std::size_t>(count); };
  include({.panel = size(plan.panel_size()),
           .value = size(plan.value_size()),
           .panel_ld = size(plan.panel_ld),
           .value_ld = size(plan.value_ld),
           .slots = size(plan.slots()),
           .locals = size(plan.nl),
           .local_factor = size(padded(plan.local_factor_size)),
           .equality_rows = size(padded(plan.equality.rows())),
           .row_entries = std::max(plan.penalty.slot.size(), plan.equality.slot.size())});
}

void MemorySizes::include(const MemorySizes& other) {
  for (auto size :
       {&MemorySizes::panel, &MemorySizes::value, &MemorySizes::panel_ld, &MemorySizes::value_ld,
        &MemorySizes::slots, &MemorySizes::locals, &MemorySizes::local_factor,
        &MemorySizes::equality_rows, &MemorySizes::row_entries})
    this->*size = std::max(this->*size, other.*size);
}

void Workspace::hand_out_memory(const MemorySizes& sizes) {
  sizes_ = sizes;
  hand_out_matrices(sizes);
  hand_out_vectors(sizes);
}

void Workspace::hand_out_matrices(const MemorySizes& sizes) {
  matrices_.reserve(knots.size() * (sizes.panel + sizes.value) + kOverhang);
  double* next = matrices_.data();
  for (Knot& knot : knots) {
    knot.panel = std::exchange(next, next + sizes.panel);
    knot.value = std::exchange(next, next + sizes.value);
  }
  value.reserve(sizes.value_ld * sizes.value_ld);
  product.reserve(sizes.panel_ld * sizes.value_ld);
  slope.reserve(sizes.value_ld);
  gradient.reserve(sizes.slots + kOverhang);
  locals.reserve(sizes.locals * (sizes.slots + kOverhang));
  scratch.reserve(kernels::kPad * sizes.row_entries);
  column.resize(sizes.slots);
}

void Workspace::hand_out_vectors(const MemorySizes& sizes) {
  const std::size_t share = sizes.local_factor + sizes.slots + sizes.value_ld;
  const std::size_t equality_share =
      sizes.equality_rows > 0 ? 3 * sizes.equality_rows + sizes.slots + sizes.value_ld : 0;
  vectors_.reserve(knots.size() * (share + equality_share) + kOverhang);
  double* next = vectors_.data();
  const auto take = [&](std::size_t count) { return std::exchange(next, next + count); };
  for (Knot& knot : knots) {
    knot.local_factor = take(sizes.local_factor);
    knot.z = take(sizes.slots);
    knot.multiplier = take(sizes.value_ld);
    if (sizes.equality_rows == 0) continue;
    knot.equality_stiffness = take(sizes.equality_rows);
    knot.equality_multiplier = take(sizes.equality_rows);
    knot.equality_residual = take(sizes.equality_rows);
    knot.correction = take(sizes.slots);
    knot.value_correction = take(sizes.value_ld);
  }
}

void Workspace::clear() {
  factorized = nullptr;
  for (AlignedBuffer* buffer :
       {&matrices_, &vectors_, &value, &product, &slope, &gradient, &locals, &scratch})
    buffer->clear();
  is_analyzed_ = false;
}

}  // namespace palanquin::structured
