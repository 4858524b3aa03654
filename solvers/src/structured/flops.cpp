#include "structured/workspace.hpp"

namespace palanquin::structured {
namespace {

/// Multiplications and additions of eliminating `pivots` of `size` rows, lower triangle.
double elimination_flops(double pivots, double size) {
  double flops = 0.0;
  for (double left = size - 1.0; left > size - 1.0 - pivots; --left)
    flops += left + left * (left + 1.0);
  return flops;
}

/// Backwards through the dynamics: P L, W = P~ F, L'W, lower triangle of F'W.
double propagation_flops(const QpStage& stage, const KnotPlan& plan, double nx_next) {
  const double columns = plan.nx + plan.nu + 1.0;
  double flops = 2.0 * stage.implicit.nnz() * (nx_next + columns) +
                 2.0 * nx_next * (stage.dynamics.nnz() + nx_next);
  for (int j = 0; j < plan.nx + plan.nu; ++j) {
    const int entries = stage.dynamics.column_start[j + 1] - stage.dynamics.column_start[j];
    const double rows_below = j < plan.nx ? plan.nx - j + 1.0 : columns - (j - plan.nx);
    flops += 2.0 * entries * rows_below;
  }
  return flops;
}

double forward_flops(const QpStage& stage, const KnotPlan& plan) {
  const double inputs = 2.0 * plan.nu * (plan.nx + 1.0) + 1.0 * plan.nu * plan.nu;
  return inputs + 2.0 * stage.dynamics.nnz() + 4.0 * stage.implicit.nnz();
}

}  // namespace

double count_flops(const StageQp& qp, const std::vector<Knot>& knots) {
  double flops = 0.0;
  for (std::size_t k = 0; k < knots.size(); ++k) {
    const KnotPlan& plan = *knots[k].plan;
    const QpStage& stage = qp.stages[k];
    if (k + 1 < knots.size()) flops += propagation_flops(stage, plan, knots[k + 1].plan->nx);
    flops += static_cast<double>(stage.hessian.nnz() + stage.nw());
    for (const kernels::LocalGroup& group : plan.groups) {
      double size = 1.0;  // the gradient
      for (int r = 0; r < group.runs; ++r) size += group.run_size[r];
      flops += elimination_flops(group.locals, size) + 2.0 * group.locals * size;
    }
    flops += elimination_flops(plan.nu, plan.nu + plan.nx + 1.0) + forward_flops(stage, plan);
  }
  return flops;
}

}  // namespace palanquin::structured
