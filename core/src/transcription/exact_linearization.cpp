// Exact Hessians in the stages of a QP, from multipliers and the lowered "exact" functions.

#include <algorithm>

#include "transcription/linearization.hpp"

namespace palanquin {

Linearization::ExactBuffers::ExactBuffers(const LoweredProblem& problem, const ExactHessian& exact)
    // At least one value: Gather reads one where there is nothing to copy.
    : hessian(static_cast<std::size_t>(
          std::max({exact.running.result(0).nnz(), exact.terminal.result(0).nnz(), 1}))),
      charted(problem.blocks().size()),
      dynamics(static_cast<std::size_t>(problem.ndx())),
      equality(most_rows(problem, RowKind::Equality)),
      inequality(most_rows(problem, RowKind::Inequality)) {}

void Linearization::use_exact_hessians(const TranscriptionInputs& inputs,
                                       const RowMatrix& trajectory,
                                       const StageQpSolution& multipliers, bool convexify,
                                       KnotFunctions& functions, StageStore& stages) {
  functions.pool().parallel_for(model_.horizon() + 1, [&](int thread, int knot) {
    const KnotShape& shape = stages.shape(knot);
    QpStage& stage = stages.stage(knot);
    set_multipliers(knot, multipliers, shape, stage);
    evaluate_exact_hessian(knot, inputs, trajectory, shape, stage, functions.workspace(thread));
    if (convexify) exact_buffers_[size_of(knot)].mirror.apply(stage.hessian);
  });
}

/// Spreads a knot's multipliers over the lowered rows.
void Linearization::set_multipliers(int knot, const StageQpSolution& multipliers,
                                    const KnotShape& shape, const QpStage& stage) {
  const std::size_t k = size_of(knot);
  ExactBuffers& out = exact_buffers_[k];
  auto spread = [](const std::vector<int>& rows, auto value, std::vector<double>& target) {
    for (std::size_t i = 0; i < rows.size(); ++i)
      target[size_of(rows[i])] = value(static_cast<Eigen::Index>(i));
  };
  std::fill(out.equality.begin(), out.equality.end(), 0.0);
  std::fill(out.inequality.begin(), out.inequality.end(), 0.0);
  spread(
      shape.equality_rows, [&](Eigen::Index i) { return multipliers.equality_multiplier[k][i]; },
      out.equality);
  spread(
      shape.inequality_rows,
      [&](Eigen::Index i) { return multipliers.inequality_multiplier[k][i]; }, out.inequality);
  // What pushes at a penalised row is the penalty's slope; its curvature is the QP's own.
  spread(
      shape.penalty_rows,
      [&](Eigen::Index i) {
        return evaluate_penalty(stage.penalty_policy[static_cast<std::size_t>(i)],
                                stage.penalty_value[i])
            .slope;
      },
      out.inequality);
  if (knot == model_.horizon()) return;
  // (I - N)' lambda belongs to the explicit dynamics (I - N)^-1 (F w + b).
  const Eigen::VectorXd& lambda = multipliers.dynamics_multiplier[k + 1];
  for (int j = 0; j < model_.problem().ndx(); ++j) {
    double sum = lambda[j];
    const SparseBlock& implicit = stage.implicit;
    for (int n = implicit.column_start[size_of(j)]; n < implicit.column_start[size_of(j + 1)]; ++n)
      sum -= implicit.values[size_of(n)] * lambda[implicit.row_index[size_of(n)]];
    out.dynamics[size_of(j)] = sum;
  }
}

void Linearization::evaluate_exact_hessian(int knot, const TranscriptionInputs& inputs,
                                           const RowMatrix& trajectory, const KnotShape& shape,
                                           QpStage& stage, FunctionWorkspace& w) {
  const std::size_t k = size_of(knot);
  const ExactHessian& exact = *model_.exact();
  ExactBuffers& buffers = exact_buffers_[k];
  const bool terminal = knot == model_.horizon();
  std::copy(shape.signature.charted.begin(), shape.signature.charted.end(),
            buffers.charted.begin());
  std::size_t argument = 0;
  auto give = [&](const double* values) { w.arguments[argument++] = values; };
  give(trajectory.row(knot).data());
  give(inputs.parameters().row(knot).data());
  if (!terminal) {
    give(buffers.charted.data());
    give(buffers.dynamics.data());
  }
  give(buffers.equality.data());
  give(buffers.inequality.data());
  w.results[0] = buffers.hessian.data();
  (terminal ? exact.terminal : exact.running)(w);

  SparseBlock& hessian = stage.hessian;
  shape.exact_hessian.write(buffers.hessian.data(), slopes_[k].data(), hessian.values.data());
}

}  // namespace palanquin
