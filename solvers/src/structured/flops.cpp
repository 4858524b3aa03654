#include <algorithm>

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
double propagation_flops(const QpStage& stage, const Knot& knot, int nx_next) {
  const KnotPlan& plan = *knot.plan;
  const double columns = knot.nx + plan.nu + 1.0;
  double flops = 2.0 * stage.implicit.nnz() * (nx_next + columns) + 2.0 * nx_next * nx_next;
  for (int j = 0; j < plan.nx + plan.nu; ++j) {
    const auto row = stage.dynamics.row_index.begin();
    const auto entries =
        std::count_if(row + stage.dynamics.column_start[j],
                      row + stage.dynamics.column_start[j + 1], [&](int i) { return i < nx_next; });
    const double rows_below = j < plan.nx ? knot.nx - j + 1.0 : columns - (j - plan.nx);
    flops += 2.0 * static_cast<double>(entries) * (nx_next + rows_below);
  }
  return flops;
}

double forward_flops(const QpStage& stage, const Knot& knot) {
  const double nu = knot.plan->nu;
  const double inputs = 2.0 * nu * (knot.nx + 1.0) + nu * nu;
  return inputs + 2.0 * stage.dynamics.nnz() + 4.0 * stage.implicit.nnz();
}

}  // namespace

double count_flops(const StageQp& qp, const std::vector<Knot>& knots) {
  double flops = 0.0;
  for (std::size_t k = 0; k < knots.size(); ++k) {
    const Knot& knot = knots[k];
    const KnotPlan& plan = *knot.plan;
    const QpStage& stage = qp.stages[k];
    if (k + 1 < knots.size()) flops += propagation_flops(stage, knot, knots[k + 1].nx);
    flops += static_cast<double>(stage.hessian.nnz() + stage.nw());
    for (const kernels::LocalGroup& group : plan.groups) {
      double size = 1.0;  // the gradient
      for (int r = 0; r < group.runs; ++r) size += group.run_size[r];
      flops += elimination_flops(group.locals, size) + 2.0 * group.locals * size;
    }
    flops += elimination_flops(plan.nu, plan.nu + knot.nx + 1.0) + forward_flops(stage, knot);
  }
  return flops;
}

}  // namespace palanquin::structured
