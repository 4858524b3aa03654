#include "structured/workspace.hpp"

#include <algorithm>

namespace palanquin::structured {

using kernels::padded;

bool Workspace::is_analyzed(const StageQp& qp) const {
  if (knots.size() != qp.stages.size() || revision_ != qp.structure_revision) return false;
  // A revision is the caller's word; sizes that contradict it would be read out of bounds.
  for (std::size_t k = 0; k < knots.size(); ++k) {
    const KnotPlan& plan = knots[k].plan;
    const QpStage& stage = qp.stages[k];
    if (plan.nx != stage.nx || plan.nu != stage.nu || plan.nl != stage.nl ||
        static_cast<int>(plan.hessian_target.size()) != stage.hessian.nnz() ||
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
  PlanCapacity capacity;
  for (const QpStage& stage : qp.stages) capacity.include(stage);
  knots.resize(qp.stages.size());
  has_equality_rows = false;
  for (std::size_t k = 0; k < knots.size(); ++k) {
    capacity.apply(knots[k].plan);
    planner_.plan(qp.stages[k], knots[k].plan);
    has_equality_rows = has_equality_rows || qp.stages[k].equality_jacobian.rows > 0;
  }
  hand_out_memory();
  flops = count_flops(qp, knots);
  revision_ = qp.structure_revision;
}

void Workspace::hand_out_memory() {
  std::size_t storage = 0, local_factor = 0, slots = 0, value_ld = 0, panel_ld = 0, rows = 0,
              model_size = 0;
  for (std::size_t k = 0; k < knots.size(); ++k) {
    const KnotPlan& plan = knots[k].plan;
    const auto raise = [](std::size_t& most, int size) {
      most = std::max(most, static_cast<std::size_t>(size));
    };
    raise(storage, plan.storage_size);
    raise(local_factor, padded(plan.local_factor_size));
    raise(slots, plan.slots());
    raise(value_ld, plan.value_ld);
    raise(panel_ld, plan.panel_ld);
    raise(rows, padded(plan.equality.rows()));
    raise(model_size, 2 * plan.penalty.rows());
  }
  // Every knot gets the largest knot's share, so that a moving pattern does not ask for more.
  storage_.reserve(knots.size() * storage);
  std::fill_n(storage_.data(), knots.size() * storage, 0.0);
  const std::size_t share =
      local_factor + slots + value_ld + (has_equality_rows ? 3 * rows + slots + value_ld : 0);
  vectors_.reserve(knots.size() * share);
  std::fill_n(vectors_.data(), knots.size() * share, 0.0);
  value.reserve(value_ld * value_ld);
  product.reserve(value_ld * panel_ld);
  slope.reserve(slots);
  model.reserve(knots.size() * model_size);

  for (std::size_t k = 0; k < knots.size(); ++k) {
    Knot& knot = knots[k];
    double* next = vectors_.data() + k * share;
    const auto take = [&](std::size_t size) {
      double* taken = next;
      next += size;
      return taken;
    };
    knot.storage = storage_.data() + k * storage;
    knot.local_factor = take(local_factor);
    knot.z = take(slots);
    knot.multiplier = take(value_ld);
    if (has_equality_rows) {
      knot.equality_stiffness = take(rows);
      knot.equality_multiplier = take(rows);
      knot.equality_residual = take(rows);
      knot.correction = take(slots);
      knot.value_correction = take(value_ld);
    }
    // Unit pivots behind the last input, see kernels::Table::partial_cholesky.
    for (int j = knot.plan.nu; j < padded(knot.plan.nu); ++j)
      knot.panel()[j * (knot.plan.panel_ld + 1)] = 1.0;
  }
}

}  // namespace palanquin::structured
