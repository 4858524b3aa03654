#include "palanquin/core/exact_hessian.hpp"

#include <algorithm>
#include <cmath>

#include "knot_buffers.hpp"
#include "palanquin/core/transcription.hpp"

namespace palanquin {

ExactHessian::ExactHessian(const std::string& path)
    : library(path), running(library, "exact_running"), terminal(library, "exact_terminal") {}

void CurvatureMirror::apply(SparseBlock& lower) {
  // Below this, relative to the largest eigenvalue, a negative one is rounding.
  constexpr double kRounding = 1e-14;
  const Eigen::Index size = lower.rows;
  matrix_.resize(size, size);
  const double* value = lower.values.data();
  for (Eigen::Index j = 0; j < size; ++j)
    for (Eigen::Index i = j; i < size; ++i) matrix_(i, j) = *value++;
  const bool is_finite = std::all_of(lower.values.begin(), lower.values.end(),
                                     [](double v) { return std::isfinite(v); });
  if (size == 0 || !is_finite) return;  // the QP back end will say so

  eigen_.compute(matrix_);
  const Eigen::VectorXd& d = eigen_.eigenvalues();
  if (eigen_.info() != Eigen::Success || d[0] >= -kRounding * std::abs(d[size - 1])) return;
  const Eigen::MatrixXd& V = eigen_.eigenvectors();
  scaled_.noalias() = V * d.cwiseAbs().asDiagonal();
  matrix_.noalias() = scaled_ * V.transpose();
  double* target = lower.values.data();
  for (Eigen::Index j = 0; j < size; ++j)
    for (Eigen::Index i = j; i < size; ++i) *target++ = matrix_(i, j);
}

Transcription::ExactBuffers::ExactBuffers(const LoweredProblem& problem, const ExactHessian& exact)
    // At least one value: Gather reads one where there is nothing to copy.
    : hessian(static_cast<std::size_t>(
          std::max({exact.running.result(0).nnz(), exact.terminal.result(0).nnz(), 1}))),
      charted(problem.blocks().size()),
      dynamics(static_cast<std::size_t>(problem.ndx())),
      equality(most_rows(problem, RowKind::Equality)),
      inequality(most_rows(problem, RowKind::Inequality)) {}

void Transcription::use_exact_hessians(const RowMatrix& trajectory,
                                       const StageQpSolution& multipliers) {
  pool_.parallel_for(horizon_ + 1, [&](int thread, int knot) {
    set_multipliers(knot, multipliers);
    evaluate_exact_hessian(thread, knot, trajectory);
  });
}

/// Spreads a knot's multipliers over the lowered rows.
void Transcription::set_multipliers(int knot, const StageQpSolution& multipliers) {
  const auto k = static_cast<std::size_t>(knot);
  const KnotShape& shape = *shapes_[k];
  const QpStage& stage = qp_.stages[k];
  ExactBuffers& out = exact_buffers_[k];
  auto spread = [](const std::vector<int>& rows, auto value, std::vector<double>& target) {
    for (std::size_t i = 0; i < rows.size(); ++i)
      target[static_cast<std::size_t>(rows[i])] = value(static_cast<Eigen::Index>(i));
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
  if (knot == horizon_) return;
  // (I - N)' lambda belongs to the explicit dynamics (I - N)^-1 (F w + b).
  const Eigen::VectorXd& lambda = multipliers.dynamics_multiplier[k + 1];
  for (int j = 0; j < problem_->ndx(); ++j) {
    double sum = lambda[j];
    const SparseBlock& implicit = stage.implicit;
    for (int n = implicit.column_start[static_cast<std::size_t>(j)];
         n < implicit.column_start[static_cast<std::size_t>(j) + 1]; ++n)
      sum -= implicit.values[static_cast<std::size_t>(n)] *
             lambda[implicit.row_index[static_cast<std::size_t>(n)]];
    out.dynamics[static_cast<std::size_t>(j)] = sum;
  }
}

void Transcription::evaluate_exact_hessian(int thread, int knot, const RowMatrix& trajectory) {
  const auto k = static_cast<std::size_t>(knot);
  const KnotShape& shape = *shapes_[k];
  ExactBuffers& buffers = exact_buffers_[k];
  FunctionWorkspace& w = workspaces_[static_cast<std::size_t>(thread)];
  const bool terminal = knot == horizon_;
  std::copy(shape.signature.charted.begin(), shape.signature.charted.end(),
            buffers.charted.begin());
  std::size_t argument = 0;
  auto give = [&](const double* values) { w.arguments[argument++] = values; };
  give(trajectory.row(knot).data());
  give(parameters_at(knot));
  if (!terminal) {
    give(buffers.charted.data());
    give(buffers.dynamics.data());
  }
  give(buffers.equality.data());
  give(buffers.inequality.data());
  w.results[0] = buffers.hessian.data();
  (terminal ? exact_->terminal : exact_->running)(w);

  SparseBlock& hessian = qp_.stages[k].hessian;
  shape.exact_hessian.write(buffers.hessian.data(), buffers_[k].slopes.data(),
                            hessian.values.data());
  buffers.mirror.apply(hessian);
}

}  // namespace palanquin
