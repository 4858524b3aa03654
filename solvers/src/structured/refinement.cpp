#include "structured/refinement.hpp"

#include <algorithm>
#include <cmath>

#include "structured/forward.hpp"

namespace palanquin::structured {
namespace {

/// Largest residuals, relative to the data that they are made of.
struct Residual {
  double stationarity = 0.0;
  double equality = 0.0;
  double max() const { return std::max(stationarity, equality); }
};

/// v += c row_i of the block
void add_row(const RowPattern& rows, int i, const double* values, double c, double* v) {
  for (int e = rows.start[i]; e < rows.start[i + 1]; ++e)
    v[rows.slot[e]] += c * values[rows.entry[e]];
}
double times_row(const RowPattern& rows, int i, const double* values, const double* z) {
  double sum = 0.0;
  for (int e = rows.start[i]; e < rows.start[i + 1]; ++e)
    sum += values[rows.entry[e]] * z[rows.slot[e]];
  return sum;
}

/// v += H z + g over slots. G's element of an entry of H tells the two slots.
void add_cost_gradient(const QpStage& stage, const KnotPlan& plan, const double* z, double* v) {
  const SparseBlock& h = stage.hessian;
  for (int j = 0; j < h.cols; ++j) {
    const int a = plan.slot[j];
    v[a] += stage.gradient[j];
    for (int e = h.column_start[j]; e < h.column_start[j + 1]; ++e) {
      const int b = plan.slot[h.row_index[e]];
      v[b] += h.values[e] * z[a];
      if (a != b) v[a] += h.values[e] * z[b];
    }
  }
}

/// v += J'(slope + curvature J z)
void add_forces(const RowPattern& rows, const SparseBlock& jacobian, const double* slope,
                const double* curvature, const double* z, double* v) {
  const double* values = jacobian.values.data();
  for (int i = 0; i < rows.rows(); ++i)
    add_row(rows, i, values, slope[i] + curvature[i] * times_row(rows, i, values, z), v);
}

/// v += F' lambda over slots
void add_dynamics_transposed(const SparseBlock& f, const KnotPlan& plan, const double* lambda,
                             double* v) {
  for (int j = 0; j < plan.nx + plan.nu; ++j)
    for (int e = f.column_start[j]; e < f.column_start[j + 1]; ++e)
      v[plan.slot[j]] += f.values[e] * lambda[f.row_index[e]];
}

/// v -= (I - N') lambda over the states
void subtract_own_multiplier(const SparseBlock* n, int nx, const double* lambda, double* v) {
  for (int i = 0; i < nx; ++i) v[i] -= lambda[i];
  if (n == nullptr) return;
  for (int j = 0; j < n->cols; ++j)
    for (int e = n->column_start[j]; e < n->column_start[j + 1]; ++e)
      v[j] += n->values[e] * lambda[n->row_index[e]];
}

double largest(const double* v, int size) {
  double most = 0.0;
  for (int i = 0; i < size; ++i) most = std::max(most, std::abs(v[i]));
  return most;
}

/// Fills the knots' corrections with the gradient of the Lagrangian and their equality residuals.
Residual evaluate(Workspace& work, const StageQp& qp) {
  Residual residual;
  const double* model = work.model.data();
  for (int k = 0; k <= qp.horizon(); ++k) {
    const QpStage& stage = qp.stages[k];
    const Knot& knot = work.knots[k];
    const KnotPlan& plan = *knot.plan;
    double* v = knot.correction;
    std::fill_n(v, plan.slots(), 0.0);
    add_cost_gradient(stage, plan, knot.z, v);
    for (int j = plan.nx; j < stage.nw(); ++j)
      v[plan.slot[j]] += work.settings.regularization * knot.z[plan.slot[j]];
    const int modelled = plan.penalty.rows() + plan.hard.rows();
    const double* curvature = model + modelled;
    add_forces(plan.penalty, stage.penalty_jacobian, model, curvature, knot.z, v);
    add_forces(plan.hard, stage.inequality_jacobian, model + plan.penalty.rows(),
               curvature + plan.penalty.rows(), knot.z, v);
    model = curvature + modelled;
    const double* equality = stage.equality_jacobian.values.data();
    for (int i = 0; i < plan.equality.rows(); ++i) {
      knot.equality_residual[i] =
          stage.equality_value[i] + times_row(plan.equality, i, equality, knot.z);
      add_row(plan.equality, i, equality, knot.equality_multiplier[i], v);
    }
    if (k < qp.horizon())
      add_dynamics_transposed(stage.dynamics, plan, work.knots[k + 1].multiplier, v);
    subtract_own_multiplier(k > 0 ? &qp.stages[k - 1].implicit : nullptr, plan.nx, knot.multiplier,
                            v + plan.state_slot);
    const double scale = 1.0 + largest(knot.multiplier, plan.nx) +
                         largest(knot.equality_multiplier, plan.equality.rows());
    residual.stationarity = std::max(residual.stationarity, largest(v, plan.gradient_slot) / scale);
    residual.equality =
        std::max(residual.equality, largest(knot.equality_residual, plan.equality.rows()) /
                                        (1.0 + largest(knot.z, plan.gradient_slot)));
  }
  return residual;
}

/// The multipliers that the stiff rows of the factorisation stood for at z.
void start_multipliers(const QpStage& stage, const Knot& knot) {
  const RowPattern& rows = knot.plan->equality;
  for (int i = 0; i < rows.rows(); ++i)
    knot.equality_multiplier[i] =
        knot.equality_stiffness[i] *
        (stage.equality_value[i] +
         times_row(rows, i, stage.equality_jacobian.values.data(), knot.z));
}

/// Right-hand side of the condensed system: the Lagrangian's gradient + C' rho (C w + e).
void condense_equality_rows(const QpStage& stage, const Knot& knot) {
  for (int i = 0; i < knot.plan->equality.rows(); ++i)
    add_row(knot.plan->equality, i, stage.equality_jacobian.values.data(),
            knot.equality_stiffness[i] * knot.equality_residual[i], knot.correction);
}

void forward_substitute_locals(const Workspace& work, const Knot& knot, double* g) {
  const KnotPlan& plan = *knot.plan;
  work.kernels->forward_substitute_groups(plan.groups.data(), static_cast<int>(plan.groups.size()),
                                          knot.local_factor, g);
}

/// The backward sweep for the gradient alone: leaves the change of p_k in value_correction.
void sweep_backward(Workspace& work, const StageQp& qp) {
  for (int k = qp.horizon(); k >= 0; --k) {
    const Knot& knot = work.knots[k];
    const KnotPlan& plan = *knot.plan;
    condense_equality_rows(qp.stages[k], knot);
    if (k < qp.horizon()) {
      const Knot& next = work.knots[k + 1];
      std::copy_n(next.value_correction, next.plan->nx, work.slope);
      substitute_transposed(qp.stages[k], plan, work.slope);
      add_dynamics_transposed(qp.stages[k].dynamics, plan, work.slope, knot.correction);
    }
    forward_substitute_locals(work, knot, knot.correction);
    double* states = knot.correction + plan.state_slot;
    const double kept = states[knot.nx];  // of an idle state, where the factors have the gradient
    work.kernels->forward_substitute(plan.nu, knot.value_rows(), knot.panel, plan.panel_ld,
                                     knot.correction + plan.input_slot);
    states[knot.nx] = kept;
    std::copy_n(states, plan.nx, knot.value_correction);
  }
}

/// The forward sweep of the step, added to z and to both kinds of multipliers.
void sweep_forward(Workspace& work, const StageQp& qp) {
  for (int k = 0; k <= qp.horizon(); ++k) {
    const QpStage& stage = qp.stages[k];
    const Knot& knot = work.knots[k];
    const KnotPlan& plan = *knot.plan;
    double* dz = knot.correction;
    double* dx = dz + plan.state_slot;
    if (k == 0) std::fill_n(dx, plan.nx, 0.0);
    std::fill_n(dx + plan.nx, plan.value_ld - plan.nx, 0.0);
    solve_inputs(work, knot, 0.0, dz);
    solve_locals(work, knot, 0.0, dz);
    double* dlambda = work.slope;
    multiply_value(work, knot, 0.0, dz, dlambda);
    for (int i = 0; i < plan.nx; ++i) dlambda[i] += knot.value_correction[i];
    if (k > 0) substitute_transposed(qp.stages[k - 1], *work.knots[k - 1].plan, dlambda);

    for (int i = 0; i < plan.nx; ++i) knot.multiplier[i] += dlambda[i];
    for (int i = 0; i < plan.equality.rows(); ++i)
      knot.equality_multiplier[i] +=
          knot.equality_stiffness[i] *
          (knot.equality_residual[i] +
           times_row(plan.equality, i, stage.equality_jacobian.values.data(), dz));
    for (int i = 0; i < plan.gradient_slot; ++i) knot.z[i] += dz[i];
    if (k == qp.horizon()) break;
    const KnotPlan& next = *work.knots[k + 1].plan;
    double* next_dx = work.knots[k + 1].correction + next.state_slot;
    std::fill_n(next_dx, next.nx, 0.0);
    advance(work, stage, plan, dz, next_dx);
  }
}

/// Farkas' lemma with what one more step adds to the multipliers, y of the rows: v = C'y + what the
/// dynamics' add is small where no step w lowers the rows. A point x that the dynamics allow has
/// y'(C x + e) >= y'(C z + e) - |v|_1 |x - z|_inf: the rows do not hold as long as that is
/// positive. Uses the multipliers up.
bool is_contradiction(Workspace& work, const StageQp& qp) {
  constexpr double kCertified = 1e3;  // no point within so many times the size of z holds the rows
  sweep_backward(work, qp);
  for (const Knot& knot : work.knots) {
    std::fill_n(knot.multiplier, knot.plan->nx, 0.0);
    std::fill_n(knot.equality_multiplier, knot.plan->equality.rows(), 0.0);
  }
  sweep_forward(work, qp);
  evaluate(work, qp);
  double gain = 0.0, slope = 0.0, size = 1.0;
  for (int k = 0; k <= qp.horizon(); ++k) {
    const QpStage& stage = qp.stages[k];
    const Knot& knot = work.knots[k];
    const KnotPlan& plan = *knot.plan;
    double* v = knot.correction;
    std::fill_n(v, plan.slots(), 0.0);
    for (int i = 0; i < plan.equality.rows(); ++i) {
      gain += knot.equality_multiplier[i] * knot.equality_residual[i];
      add_row(plan.equality, i, stage.equality_jacobian.values.data(), knot.equality_multiplier[i],
              v);
    }
    if (k < qp.horizon())
      add_dynamics_transposed(stage.dynamics, plan, work.knots[k + 1].multiplier, v);
    subtract_own_multiplier(k > 0 ? &qp.stages[k - 1].implicit : nullptr, plan.nx, knot.multiplier,
                            v + plan.state_slot);
    if (k == 0) std::fill_n(v + plan.state_slot, plan.nx, 0.0);  // x_0 is given
    for (int i = 0; i < plan.gradient_slot; ++i) slope += std::abs(v[i]);
    size = std::max(size, largest(knot.z, plan.gradient_slot));
  }
  return gain > kCertified * size * slope;
}

}  // namespace

QpStatus refine_equality_rows(Workspace& work, const StageQp& qp) {
  find_multipliers(work, qp);
  for (int k = 0; k <= qp.horizon(); ++k) start_multipliers(qp.stages[k], work.knots[k]);
  constexpr double kStalled = 0.5;  // less progress than this is none
  constexpr double kUsable = 1e-6;  // residual at which a stalled point may be used
  const StructuredQpSettings& settings = work.settings;
  Residual residual = evaluate(work, qp);
  for (int i = 0; i < settings.max_refinements; ++i) {
    if (residual.max() <= settings.equality_tolerance) return QpStatus::Solved;
    const double before = residual.max();
    sweep_backward(work, qp);
    sweep_forward(work, qp);
    residual = evaluate(work, qp);
    if (!std::isfinite(residual.max())) return QpStatus::NonFinite;
    if (residual.max() > kStalled * before) break;
  }
  if (residual.max() <= settings.equality_tolerance) return QpStatus::Solved;
  if (residual.equality <= kUsable) return QpStatus::Inaccurate;
  return is_contradiction(work, qp) ? QpStatus::PrimalInfeasible : QpStatus::NotSolved;
}

}  // namespace palanquin::structured
