#include "structured/forward.hpp"

#include <algorithm>
#include <cmath>

namespace palanquin::structured {
namespace {

/// While it lives, a constant stands in `z` where the factors have the gradient's row: behind the
/// states, in place of the first idle one if there is one.
class ConstantInPlace {
 public:
  ConstantInPlace(const Knot& knot, double constant, double* z)
      : place_(z + knot.plan->state_slot + knot.nx), kept_(*place_) {
    *place_ = constant;
  }
  ~ConstantInPlace() { *place_ = kept_; }
  ConstantInPlace(const ConstantInPlace&) = delete;
  ConstantInPlace& operator=(const ConstantInPlace&) = delete;

 private:
  double* place_;
  double kept_;
};

}  // namespace

void solve_inputs(const Workspace& work, const Knot& knot, double constant, double* z) {
  const KnotPlan& plan = *knot.plan;
  const ConstantInPlace in_place(knot, constant, z);
  work.kernels->back_substitute(plan.nu, knot.value_rows(), knot.panel, plan.panel_ld,
                                z + plan.input_slot);
}

void solve_locals(const Workspace& work, const Knot& knot, double constant, double* z) {
  const KnotPlan& plan = *knot.plan;
  work.kernels->back_substitute_groups(plan.groups.data(), static_cast<int>(plan.groups.size()),
                                       knot.local_factor, constant, z);
}

void multiply_value(const Workspace& work, const Knot& knot, double constant, double* z,
                    double* y) {
  const KnotPlan& plan = *knot.plan;
  const ConstantInPlace in_place(knot, constant, z);
  work.kernels->symmetric_multiply(knot.value_rows(), knot.nx, knot.value, plan.value_ld,
                                   z + plan.state_slot, y);
  std::fill(y + knot.nx, y + plan.nx, 0.0);
}

namespace {

/// Zero if every entry is finite, else NaN.
double finiteness(const double* v, int size) {
  return (0.0 * Eigen::Map<const Eigen::ArrayXd>(v, size)).sum();
}

}  // namespace

void advance(const Workspace& work, const QpStage& stage, const KnotPlan& plan, const double* z,
             double* next_x) {
  work.kernels->multiply_runs_add(plan.dynamics.lists(), stage.dynamics.values.data(), z, next_x);
  const SparseBlock& n = stage.implicit;
  const auto& order = plan.substitution_order;
  for (auto c = order.rbegin(); c != order.rend(); ++c)
    for (int e = n.column_start[*c]; e < n.column_start[*c + 1]; ++e)
      next_x[n.row_index[e]] += n.values[e] * next_x[*c];
}

void substitute_transposed(const QpStage& stage, const KnotPlan& plan, double* v) {
  const SparseBlock& n = stage.implicit;
  for (int c : plan.substitution_order)
    for (int e = n.column_start[c]; e < n.column_start[c + 1]; ++e)
      v[c] += n.values[e] * v[n.row_index[e]];
}

bool roll_out(Workspace& work, const StageQp& qp, const Eigen::VectorXd& initial_state) {
  for (int k = 0; k <= qp.horizon(); ++k) {
    const Knot& knot = work.knots[k];
    const KnotPlan& plan = *knot.plan;
    double* x = knot.z + plan.state_slot;
    if (k == 0) std::copy_n(initial_state.data(), plan.nx, x);
    std::fill_n(knot.z, plan.state_slot, 0.0);
    std::fill(x + plan.nx, x + plan.value_ld, 0.0);
    solve_inputs(work, knot, 1.0, knot.z);
    solve_locals(work, knot, 1.0, knot.z);
    if (k == qp.horizon()) break;
    double* next_x = work.knots[k + 1].z + work.knots[k + 1].plan->state_slot;
    std::copy_n(qp.stages[k].offset.data(), qp.stages[k].offset.size(), next_x);
    advance(work, qp.stages[k], plan, knot.z, next_x);
  }
  const Knot& first = work.knots.front();  // whose value function no z depends on
  double finite = finiteness(first.value, first.plan->value_ld * first.nx);
  for (const Knot& knot : work.knots) finite += finiteness(knot.z, knot.plan->gradient_slot);
  return finite == 0.0;
}

void find_multipliers(Workspace& work, const StageQp& qp) {
  for (int k = 0; k <= qp.horizon(); ++k) {
    const Knot& knot = work.knots[k];
    multiply_value(work, knot, 1.0, knot.z, knot.multiplier);
    if (k > 0) substitute_transposed(qp.stages[k - 1], *work.knots[k - 1].plan, knot.multiplier);
  }
}

void unpack(const Workspace& work, StageQpSolution& solution) {
  for (std::size_t k = 0; k < work.knots.size(); ++k) {
    const Knot& knot = work.knots[k];
    const KnotPlan& plan = *knot.plan;
    double* w = solution.w[k].data();
    w = std::copy_n(knot.z + plan.state_slot, plan.nx, w);
    w = std::copy_n(knot.z + plan.input_slot, plan.nu, w);
    std::copy_n(knot.z, plan.nl, w);
    if (plan.equality.rows() > 0)
      std::copy_n(knot.equality_multiplier, plan.equality.rows(),
                  solution.equality_multiplier[k].data());
  }
}

}  // namespace palanquin::structured
