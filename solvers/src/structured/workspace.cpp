#include "structured/workspace.hpp"

#include <algorithm>

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

template <class Take>
void take_knot(const MemorySizes& sizes, Knot& knot, Take take) {
  take(knot.panel, sizes.panel);
  take(knot.value, sizes.value);
  take(knot.local_factor, sizes.local_factor);
  take(knot.z, sizes.slots);
  take(knot.multiplier, sizes.value_ld);
  if (sizes.equality_rows == 0) return;
  take(knot.equality_stiffness, sizes.equality_rows);
  take(knot.equality_multiplier, sizes.equality_rows);
  take(knot.equality_residual, sizes.equality_rows);
  take(knot.correction, sizes.slots);
  take(knot.value_correction, sizes.value_ld);
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
  if (laid_out_ != knots.size() || sizes != sizes_) hand_out_memory(sizes);
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
           .row_entries = std::max(
               {plan.penalty.slot.size(), plan.hard.slot.size(), plan.equality.slot.size()})});
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
  laid_out_ = knots.size();
  double* start = nullptr;
  std::size_t used = 0;
  const auto take = [&](double*& array, std::size_t size) {
    if (start != nullptr) array = start + used;
    used += size;
  };
  const auto take_all = [&] {
    used = 0;
    take(value, sizes.value_ld * sizes.value_ld);
    take(product, sizes.value_ld * sizes.panel_ld);
    take(slope, sizes.value_ld);
    take(gradient, sizes.slots + kOverhang);
    take(locals, sizes.locals * (sizes.slots + kOverhang));
    take(scratch, kernels::kPad * sizes.row_entries);
    for (Knot& knot : knots) take_knot(sizes, knot, take);
    used += kOverhang;
  };
  take_all();  // for the sum of the sizes
  memory_.reserve(used);
  memory_.clear();
  start = memory_.data();
  take_all();
  column.resize(sizes.slots);
  column_end.resize(sizes.slots);
}

void Workspace::clear() {
  factorized = nullptr;
  is_solved = false;
  is_analyzed_ = false;
  memory_.clear();
}

}  // namespace palanquin::structured
