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

/// Steps (1) and (2): W = P L [F b] + [0 p], its columns in the order of the panel's rows. L from
/// the left comes in propagate_value.
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
  const int first_state = padded(plan.nu);
  const int constant = first_state + plan.nx;
  kernels.multiply(ld, dynamics, plan.nx, plan.nu, value, ld, product, ld);
  kernels.multiply(ld, dynamics, 0, plan.nx, value, ld, product + first_state * ld, ld);
  clear_columns(product, ld, plan.nu, first_state);
  clear_columns(product, ld, constant, plan.panel_ld);
  double* gradient = product + constant * ld;
  for (int i = 0; i < nx_next; ++i) gradient[i] = next.value()[nx_next + i * next.plan.value_ld];
  kernels.multiply_add(ld, nx_next, value, ld, stage.offset.data(), gradient);
}

/// Step (3), the part from the next knot: lower triangle of F'L'P L F, with the gradient's row
/// F'L'(P L b + p). Transposed, W's rows are columns: L from the left works on columns too.
void propagate_value(Workspace& work, const QpStage& stage, const Knot& knot, const Knot& next) {
  multiply_by_value(work, stage, knot, next);
  const kernels::Table& kernels = *work.kernels;
  const KnotPlan& plan = knot.plan;
  const int ld_product = padded(next.plan.nx);
  double* transposed = work.transposed.data();
  kernels.transpose(ld_product, plan.panel_ld, work.product.data(), ld_product, transposed,
                    plan.panel_ld);
  kernels.substitute(plan.panel_ld, columns_of(stage.implicit), plan.substitution_order.data(),
                     static_cast<int>(plan.substitution_order.size()), transposed, plan.panel_ld);

  const SparseColumns dynamics = columns_of(stage.dynamics);
  kernels.multiply_lower(plan.panel_ld, dynamics, plan.nx, plan.nu, transposed, plan.panel_ld,
                         knot.panel(), plan.panel_ld);
  kernels.multiply_lower(plan.value_ld, dynamics, 0, plan.nx, transposed + padded(plan.nu),
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

/// Step (3): J'D J and J's. Most penalty rows are idle and cost two comparisons.
void add_rows(const Knot& knot, const RowPattern& rows, const double* values,
              const double* curvature, const double* slope) {
  const int* column = knot.plan.column_offset.data();
  const int gradient = knot.plan.gradient_slot;
  for (int i = 0; i < rows.rows(); ++i) {
    const int end = rows.start[i + 1];
    if (slope[i] != 0.0)
      for (int e = rows.start[i]; e < end; ++e)
        knot.storage[column[rows.slot[e]] + gradient] += slope[i] * values[rows.entry[e]];
    if (curvature[i] == 0.0) continue;
    for (int e = rows.start[i]; e < end; ++e) {
      const double scaled = curvature[i] * values[rows.entry[e]];
      double* target = knot.storage + column[rows.slot[e]];
      for (int f = e; f < end; ++f) target[rows.slot[f]] += scaled * values[rows.entry[f]];
    }
  }
}

/// Stiffness of the equality rows in proportion to the cost, and the slope that goes with it.
void add_equality_rows(const StructuredQpSettings& settings, const QpStage& stage,
                       const Knot& knot) {
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
        settings.equality_weight * largest / (squared_norm > 0.0 ? squared_norm : 1.0);
    knot.equality_residual[i] = knot.equality_stiffness[i] * stage.equality_value[i];
  }
  add_rows(knot, rows, jacobian.values.data(), knot.equality_stiffness, knot.equality_residual);
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
           model.slope[k].data());
  if (plan.equality.rows() > 0) add_equality_rows(work.settings, stage, knot);
  return eliminate_locals(knot, work.settings.pivot_tolerance) && eliminate_inputs(work, knot);
}

}  // namespace palanquin::structured
