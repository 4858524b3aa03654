#include "structured/backward.hpp"

#include <algorithm>

namespace palanquin::structured {
namespace {

using kernels::padded;
using kernels::SparseColumns;

SparseColumns columns_of(const SparseBlock& block) {
  const int* start = block.column_start.data();
  return {start, start + 1, block.row_index.data(), block.values.data()};
}

/// The dynamics' rows of states that the next knot's value function depends on.
SparseColumns dynamics_of(Workspace& work, const QpStage& stage, const Knot& next) {
  SparseColumns columns = columns_of(stage.dynamics);
  if (next.nx == next.plan->nx) return columns;
  for (int j = 0; j < stage.nx + stage.nu; ++j) {
    int end = columns.end[j];
    while (end > columns.start[j] && columns.row[end - 1] >= next.nx) --end;
    work.column_end[j] = end;
  }
  columns.end = work.column_end.data();
  return columns;
}

void clear_columns(double* matrix, int ld, int first, int last) {
  std::fill(matrix + first * ld, matrix + last * ld, 0.0);
}

/// The number of states up to the last one that anything depends on: the knot's cost and rows, its
/// dynamics, or other states at the same time.
int count_states(const Workspace& work, const QpStage& stage, const PenaltyModel& model, int k) {
  const KnotPlan& plan = *work.knots[k].plan;
  const RememberedStates& remembered = plan.remembered;
  const int least = std::max(plan.moving_nx(), k > 0 ? work.knots[k - 1].plan->implicit_states : 0);
  int nx = plan.nx;
  while (nx > least && stage.gradient[nx - 1] == 0.0) --nx;
  if (nx == plan.nx) return nx;
  for (const RememberedStates::Entry& e : remembered.hessian)
    if (!(stage.hessian.values[e.entry] == 0.0)) nx = std::max(nx, e.until);
  const double *curvature = model.curvature[k].data(), *slope = model.slope[k].data();
  for (const std::vector<int>* until : {&remembered.penalty, &remembered.hard}) {
    for (std::size_t i = 0; i < until->size(); ++i) {
      const bool is_idle = (curvature[i] == 0.0) & (slope[i] == 0.0);
      nx = std::max(nx, is_idle ? 0 : (*until)[i]);
    }
    curvature += until->size();
    slope += until->size();
  }
  return nx;
}

/// Steps (1) and (2): W' = [F b]' L P + [0 p]', its rows in the order of the panel's. L' from the
/// left comes in propagate_value.
void multiply_by_value(Workspace& work, const QpStage& stage, const SparseColumns& dynamics,
                       const Knot& knot, const Knot& next) {
  const kernels::Table& kernels = *work.kernels;
  const KnotPlan& plan = *knot.plan;
  const int ld = padded(next.nx);
  double* value = work.value;
  double* slope = work.slope;  // becomes P L b + p
  for (int i = 0; i < next.nx; ++i) slope[i] = next.value[next.nx + i * next.plan->value_ld];
  kernels.symmetrize(next.nx, next.value, next.plan->value_ld, value, ld);
  kernels.substitute(ld, columns_of(stage.implicit), plan.substitution_order.data(),
                     static_cast<int>(plan.substitution_order.size()), value, ld);
  kernels.multiply_add(ld, next.nx, value, ld, stage.offset.data(), slope);

  double* inputs = work.product;
  double* states = inputs + padded(plan.nu);
  kernels.multiply_transposed(ld, dynamics, 0, plan.moving_nx(), value, ld, states, plan.panel_ld);
  for (int i = 0; i < next.nx; ++i) {
    double* column = states + i * plan.panel_ld;
    std::fill(column + padded(plan.moving_nx()), column + knot.value_rows(), 0.0);
    column[knot.nx] = slope[i];
  }
  kernels.multiply_transposed(ld, dynamics, plan.nx, plan.nu, value, ld, inputs, plan.panel_ld);
}

/// Step (3), the part from the next knot: lower triangle of F'L'P L F, with the gradient's row
/// F'L'(P L b + p). W' has W's rows as columns: L' from the left works on columns too.
void propagate_value(Workspace& work, const QpStage& stage, const Knot& knot, const Knot& next) {
  const SparseColumns dynamics = dynamics_of(work, stage, next);
  multiply_by_value(work, stage, dynamics, knot, next);
  const kernels::Table& kernels = *work.kernels;
  const KnotPlan& plan = *knot.plan;
  double* product = work.product;
  kernels.substitute(knot.panel_rows(), columns_of(stage.implicit), plan.substitution_order.data(),
                     static_cast<int>(plan.substitution_order.size()), product, plan.panel_ld);
  kernels.multiply_lower(knot.value_rows(), dynamics, 0, plan.moving_nx(),
                         product + padded(plan.nu), plan.panel_ld, knot.value, plan.value_ld);
  kernels.multiply_lower(knot.panel_rows(), dynamics, plan.nx, plan.nu, product, plan.panel_ld,
                         knot.panel, plan.panel_ld);
}

/// Where the columns of the knot's G begin, by slots: panel and value start at the rows of inputs
/// and states.
void point_to_columns(Workspace& work, const Knot& knot) {
  const KnotPlan& plan = *knot.plan;
  double** column = work.column.data();
  for (int j = 0; j < plan.nl; ++j) column[j] = work.locals + j * plan.local_ld();
  for (int j = 0; j < plan.nu; ++j)
    column[plan.input_slot + j] = knot.panel + j * plan.panel_ld - plan.input_slot;
  for (int j = 0; j < plan.nx; ++j)
    column[plan.state_slot + j] = knot.value + j * plan.value_ld - plan.state_slot;
}

/// Step (3): entries of the knot's own Hessian in the columns that `columns` holds.
void add_hessian(const QpStage& stage, const std::vector<HessianEntry>& entries, double* columns) {
  const double* values = stage.hessian.values.data();
  for (const HessianEntry& e : entries) columns[e.place] += values[e.entry];
}

/// The knot's own gradient over slots.
void start_gradient(const QpStage& stage, const KnotPlan& plan, double* gradient) {
  const double* g = stage.gradient.data();
  std::copy_n(g, plan.nx, gradient + plan.state_slot);
  std::copy_n(g + plan.nx, plan.nu, gradient + plan.input_slot);
  std::copy_n(g + plan.nx + plan.nu, plan.nl, gradient);
}

void regularize(const Workspace& work, const KnotPlan& plan, double regularization) {
  for (int slot = 0; slot < plan.nl; ++slot) work.column[slot][slot] += regularization;
  for (int slot = plan.input_slot; slot < plan.input_slot + plan.nu; ++slot)
    work.column[slot][slot] += regularization;
}

/// Step (3): J'D J and J's. Idle rows cost a comparison.
void add_rows(Workspace& work, const RowPattern& rows, const SparseBlock& jacobian,
              const double* curvature, const double* slope, double* gradient) {
  work.kernels->add_weighted_rows(rows.by_runs(), jacobian.values.data(), curvature, slope,
                                  work.column.data(), gradient, work.scratch);
}

/// Stiffness of the equality rows in proportion to the cost, and the slope that goes with it.
void add_equality_rows(Workspace& work, const QpStage& stage, const Knot& knot, double* gradient) {
  const SparseBlock& jacobian = stage.equality_jacobian;
  const RowPattern& rows = knot.plan->equality;
  double largest = work.least_curvature;
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
  add_rows(work, rows, jacobian, knot.equality_stiffness, knot.equality_residual, gradient);
}

/// Step (4): locals leave G and the gradient, group by group.
bool eliminate_locals(const Workspace& work, const Knot& knot, double* gradient) {
  const KnotPlan& plan = *knot.plan;
  return work.kernels->eliminate_groups(plan.groups.data(), static_cast<int>(plan.groups.size()),
                                        work.settings.pivot_tolerance, work.column.data(), gradient,
                                        knot.local_factor);
}

/// The gradient becomes G's last row.
void add_gradient(const KnotPlan& plan, const double* gradient, const Knot& knot) {
  double* input = knot.panel + padded(plan.nu) + knot.nx;
  for (int j = 0; j < plan.nu; ++j) input[j * plan.panel_ld] += gradient[plan.input_slot + j];
  double* state = knot.value + knot.nx;
  for (int j = 0; j < knot.nx; ++j) state[j * plan.value_ld] += gradient[plan.state_slot + j];
}

/// Step (5): inputs are pivots, P_k and p_k remain in value().
bool eliminate_inputs(const Workspace& work, const Knot& knot) {
  const KnotPlan& plan = *knot.plan;
  return work.kernels->partial_cholesky(plan.nu, knot.value_rows(), knot.nx,
                                        work.settings.pivot_tolerance, knot.panel, plan.panel_ld,
                                        knot.value, plan.value_ld) < 0;
}

}  // namespace

// The order of the additions into G keeps narrow stores away from vector loads of the same place,
// which would wait for them: locals' own entries long before their rows, the others' at the end.
bool factorize_knot(Workspace& work, const StageQp& qp, const PenaltyModel& model, int k) {
  const QpStage& stage = qp.stages[k];
  Knot& knot = work.knots[k];
  const KnotPlan& plan = *knot.plan;
  double* gradient = work.gradient;
  knot.nx = count_states(work, stage, model, k);
  point_to_columns(work, knot);
  start_gradient(stage, plan, gradient);
  add_hessian(stage, plan.local_hessian, work.locals);
  clear_columns(knot.value, plan.value_ld, plan.moving_nx(), padded(knot.nx));
  if (k < qp.horizon()) {
    propagate_value(work, stage, knot, work.knots[k + 1]);
  } else {
    clear_columns(knot.panel, plan.panel_ld, 0, plan.nu);
    clear_columns(knot.value, plan.value_ld, 0, plan.nx);
  }
  if (work.settings.regularization > 0.0) regularize(work, plan, work.settings.regularization);
  add_rows(work, plan.penalty, stage.penalty_jacobian, model.curvature[k].data(),
           model.slope[k].data(), gradient);
  if (plan.hard.rows() > 0)
    add_rows(work, plan.hard, stage.inequality_jacobian,
             model.curvature[k].data() + plan.penalty.rows(),
             model.slope[k].data() + plan.penalty.rows(), gradient);
  if (plan.equality.rows() > 0) add_equality_rows(work, stage, knot, gradient);
  if (!eliminate_locals(work, knot, gradient)) return false;
  add_hessian(stage, plan.input_hessian, knot.panel);
  add_hessian(stage, plan.state_hessian, knot.value);
  add_gradient(plan, gradient, knot);
  return eliminate_inputs(work, knot);
}

}  // namespace palanquin::structured
