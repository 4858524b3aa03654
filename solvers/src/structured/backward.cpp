#include "structured/backward.hpp"

#include <algorithm>

namespace palanquin::structured {
namespace {

using kernels::padded;
using kernels::SparseColumns;

SparseColumns columns_of(const SparseBlock& block) {
  return {block.column_start.data(), block.row_index.data(), block.values.data()};
}

void clear_columns(double* matrix, int ld, int first, int last) {
  std::fill(matrix + first * ld, matrix + last * ld, 0.0);
}

/// Steps (1) and (2): W' = [F b]' L P + [0 p]', its rows in the order of the panel's. L' from the
/// left comes in propagate_value.
void multiply_by_value(Workspace& work, const QpStage& stage, const Knot& knot, const Knot& next) {
  const kernels::Table& kernels = *work.kernels;
  const KnotPlan& plan = knot.plan;
  const int nx_next = next.plan.nx;
  const int ld = padded(nx_next);
  double* value = work.value.data();
  kernels.symmetrize(nx_next, next.value(), next.plan.value_ld, value, ld);
  kernels.substitute(ld, columns_of(stage.implicit), plan.substitution_order.data(),
                     static_cast<int>(plan.substitution_order.size()), value, ld);

  const SparseColumns dynamics = columns_of(stage.dynamics);
  double* product = work.product.data();
  double* states = product + padded(plan.nu);
  kernels.multiply_transposed(ld, dynamics, plan.nx, plan.nu, value, ld, product, plan.panel_ld);
  kernels.multiply_transposed(ld, dynamics, 0, plan.nx, value, ld, states, plan.panel_ld);
  double* slope = work.slope.data();  // P L b + p
  for (int i = 0; i < nx_next; ++i) slope[i] = next.value()[nx_next + i * next.plan.value_ld];
  kernels.multiply_add(ld, nx_next, value, ld, stage.offset.data(), slope);
  for (int i = 0; i < nx_next; ++i) {
    double* column = states + i * plan.panel_ld;
    for (int row = padded(plan.nx); row < plan.value_ld; ++row) column[row] = 0.0;
    column[plan.nx] = slope[i];
  }
}

/// Step (3), the part from the next knot: lower triangle of F'L'P L F, with the gradient's row
/// F'L'(P L b + p). W' has W's rows as columns: L' from the left works on columns too.
void propagate_value(Workspace& work, const QpStage& stage, const Knot& knot, const Knot& next) {
  multiply_by_value(work, stage, knot, next);
  const kernels::Table& kernels = *work.kernels;
  const KnotPlan& plan = knot.plan;
  double* product = work.product.data();
  kernels.substitute(plan.panel_ld, columns_of(stage.implicit), plan.substitution_order.data(),
                     static_cast<int>(plan.substitution_order.size()), product, plan.panel_ld);

  const SparseColumns dynamics = columns_of(stage.dynamics);
  kernels.multiply_lower(plan.panel_ld, dynamics, plan.nx, plan.nu, product, plan.panel_ld,
                         knot.panel(), plan.panel_ld);
  kernels.multiply_lower(plan.value_ld, dynamics, 0, plan.nx, product + padded(plan.nu),
                         plan.panel_ld, knot.value(), plan.value_ld);
}

/// Step (3): the knot's own cost.
void add_cost(const QpStage& stage, const Knot& knot, double regularization) {
  const KnotPlan& plan = knot.plan;
  for (std::size_t e = 0; e < plan.hessian_target.size(); ++e)
    knot.storage[plan.hessian_target[e]] += stage.hessian.values[e];
  for (std::size_t j = 0; j < plan.gradient_target.size(); ++j)
    knot.storage[plan.gradient_target[j]] += stage.gradient[j];
  if (regularization == 0.0) return;
  for (int j = plan.nx; j < stage.nw(); ++j)
    knot.storage[plan.column_offset[plan.slot[j]] + plan.slot[j]] += regularization;
}

/// Step (3): J'D J and J's. Most penalty rows are idle and cost a comparison.
void add_rows(const Knot& knot, const RowPattern& rows, const double* values,
              const double* curvature, const double* slope, double* row_values) {
  const int* column = knot.plan.column_offset.data();
  const int gradient = knot.plan.gradient_slot;
  for (int i = 0; i < rows.rows(); ++i) {
    if (curvature[i] == 0.0 && slope[i] == 0.0) continue;
    const int* slot = rows.slot.data() + rows.start[i];
    const int* entry = rows.entry.data() + rows.start[i];
    const int size = rows.start[i + 1] - rows.start[i];
    for (int e = 0; e < size; ++e) row_values[e] = values[entry[e]];
    for (int e = 0; e < size; ++e) {
      double* target = knot.storage + column[slot[e]];
      target[gradient] += slope[i] * row_values[e];
      const double scaled = curvature[i] * row_values[e];
      for (int f = e; f < size; ++f) target[slot[f]] += scaled * row_values[f];
    }
  }
}

/// Stiffness of the equality rows in proportion to the cost, and the slope that goes with it.
void add_equality_rows(const Workspace& work, const QpStage& stage, const Knot& knot,
                       double* row_values) {
  const SparseBlock& jacobian = stage.equality_jacobian;
  const RowPattern& rows = knot.plan.equality;
  double largest = 0.0;
  for (int j = 0; j < stage.hessian.cols; ++j)
    largest = std::max(largest, stage.hessian.values[stage.hessian.column_start[j]]);
  if (!(largest > 0.0)) largest = 1.0;
  for (int i = 0; i < rows.rows(); ++i) {
    double squared_norm = 0.0;
    for (int e = rows.start[i]; e < rows.start[i + 1]; ++e)
      squared_norm += jacobian.values[rows.entry[e]] * jacobian.values[rows.entry[e]];
    knot.equality_stiffness[i] =
        work.settings.equality_weight * largest / (squared_norm > 0.0 ? squared_norm : 1.0);
    knot.equality_residual[i] = knot.equality_stiffness[i] * stage.equality_value[i];
  }
  add_rows(knot, rows, jacobian.values.data(), knot.equality_stiffness, knot.equality_residual,
           row_values);
}

/// Step (5): inputs are pivots, P_k and p_k remain in value().
bool eliminate_inputs(const Workspace& work, const Knot& knot) {
  const KnotPlan& plan = knot.plan;
  return work.kernels->partial_cholesky(plan.nu, plan.value_ld, plan.nx,
                                        work.settings.pivot_tolerance, knot.panel(), plan.panel_ld,
                                        knot.value(), plan.value_ld) < 0;
}

}  // namespace

bool factorize_knot(Workspace& work, const StageQp& qp, const PenaltyModel& model, int k) {
  const QpStage& stage = qp.stages[k];
  const Knot& knot = work.knots[k];
  const KnotPlan& plan = knot.plan;
  std::fill_n(knot.storage, plan.panel_offset, 0.0);  // the locals' columns
  clear_columns(knot.value(), plan.value_ld, plan.nx, padded(plan.nx));
  if (k < qp.horizon()) {
    propagate_value(work, stage, knot, work.knots[k + 1]);
  } else {
    clear_columns(knot.panel(), plan.panel_ld, 0, plan.nu);
    clear_columns(knot.value(), plan.value_ld, 0, plan.nx);
  }
  add_cost(stage, knot, work.settings.regularization);
  add_rows(knot, plan.penalty, stage.penalty_jacobian.values.data(), model.curvature[k].data(),
           model.slope[k].data(), work.slope.data());
  if (plan.equality.rows() > 0) add_equality_rows(work, stage, knot, work.slope.data());
  return eliminate_locals(knot, work.settings.pivot_tolerance) && eliminate_inputs(work, knot);
}

}  // namespace palanquin::structured
