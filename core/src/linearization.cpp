// Evaluating and linearising all knots: the lowered functions are called per knot, in parallel when
// the pool has more than one thread, and gathered into the stage QP.

#include <algorithm>
#include <cmath>

#include "knot_buffers.hpp"
#include "palanquin/core/manifold.hpp"
#include "palanquin/core/transcription.hpp"

namespace palanquin {

void Transcription::evaluate_knot(int thread, int knot, const RowMatrix& trajectory, bool linear) {
  FunctionWorkspace& w = workspaces_[static_cast<std::size_t>(thread)];
  KnotBuffers& out = buffers_[static_cast<std::size_t>(knot)];
  DerivativeBuffers& derivatives = derivatives_[static_cast<std::size_t>(thread)];
  const double* z = trajectory.row(knot).data();
  const bool terminal = knot == horizon_;

  int argument = 0, result = 0;
  w.arguments[static_cast<std::size_t>(argument++)] = z;
  if (!terminal) {
    w.arguments[static_cast<std::size_t>(argument++)] = trajectory.row(knot + 1).data();
    w.results[static_cast<std::size_t>(result++)] = out.next_state.data();
  }
  w.arguments[static_cast<std::size_t>(argument++)] = parameters_at(knot);
  auto give = [&](double* target) { w.results[static_cast<std::size_t>(result++)] = target; };
  give(&out.cost);
  give(out.equality.data());
  give(out.inequality.data());
  if (linear) {
    if (!terminal) {
      give(derivatives.dynamics.data());
      give(derivatives.implicit.data());
    }
    give(derivatives.gradient.data());
    give(derivatives.hessian.data());
    give(derivatives.equality.data());
    give(derivatives.inequality.data());
  }
  if (terminal)
    (linear ? problem_->terminal_linear : problem_->terminal)(w);
  else
    (linear ? problem_->running_linear : problem_->running)(w);
  if (!terminal) evaluate_defect(knot, trajectory);

  const KnotShape& shape = *shapes_[static_cast<std::size_t>(knot)];
  if (!shape.link_rows.empty() || !shape.initial_links.empty()) {
    w.arguments[0] = knot > 0 ? trajectory.row(knot - 1).data() : measured_.data();
    w.arguments[1] = z;
    w.arguments[2] = parameters_at(knot);
    w.results[0] = out.link.data();
    w.results[1] = derivatives.link_previous.data();
    w.results[2] = derivatives.link.data();
    (linear ? problem_->link_linear : problem_->link)(w);
  }
  if (linear && std::any_of(shape.signature.charted.begin(), shape.signature.charted.end(),
                            [](char c) { return c != 0; })) {
    w.arguments[0] = z;
    w.arguments[1] = parameters_at(knot);
    w.results[0] = derivatives.embedded.data();
    w.results[1] = out.slopes.data();
    problem_->chart(w);
  }
}

/// Residual d (-) x_{k+1} of the knot's dynamics [ndx].
void Transcription::evaluate_defect(int knot, const RowMatrix& trajectory) {
  KnotBuffers& out = buffers_[static_cast<std::size_t>(knot)];
  const double* next = trajectory.row(knot + 1).data();
  const double* d = out.next_state.data();
  double* rows = out.defect.data();
  for (const BlockInfo& b : problem_->blocks()) {
    if (!b.is_state) continue;
    if (b.is_quaternion) {
      Eigen::Map<Vector3>{rows} = quaternion_minus(Eigen::Map<const Vector4>(d),
                                                   Eigen::Map<const Vector4>(next + b.offset));
    } else {
      for (int i = 0; i < b.size; ++i) rows[i] = d[i] - next[b.offset + i];
    }
    rows += b.tangent_size;
    d += b.size;
  }
}

void Transcription::fill_stage(int thread, int knot, const RowMatrix& trajectory) {
  const KnotShape& shape = *shapes_[static_cast<std::size_t>(knot)];
  KnotBuffers& in = buffers_[static_cast<std::size_t>(knot)];
  const DerivativeBuffers& derivatives = derivatives_[static_cast<std::size_t>(thread)];
  QpStage& stage = qp_.stages[static_cast<std::size_t>(knot)];
  const double* slopes = in.slopes.data();
  auto write = [&](const Gather& recipe, const std::vector<double>& source, SparseBlock& block) {
    recipe.write(source.data(), slopes, block.values.data());
  };
  auto pick = [](const std::vector<int>& rows, const std::vector<double>& source, double* target) {
    for (std::size_t i = 0; i < rows.size(); ++i)
      target[i] = source[static_cast<std::size_t>(rows[i])];
  };

  write(shape.hessian, derivatives.hessian, stage.hessian);
  shape.gradient.write(derivatives.gradient.data(), slopes, stage.gradient.data());
  write(shape.penalty, derivatives.inequality, stage.penalty_jacobian);
  write(shape.inequality, derivatives.inequality, stage.inequality_jacobian);
  write(shape.equality, derivatives.equality, stage.equality_jacobian);
  shape.initial_link.add(derivatives.link.data(), slopes, stage.equality_jacobian.values.data());
  write(shape.link_previous, derivatives.link_previous, stage.link_previous);
  write(shape.link, derivatives.link, stage.link_jacobian);
  pick(shape.penalty_rows, in.inequality, stage.penalty_value.data());
  pick(shape.inequality_rows, in.inequality, stage.inequality_value.data());
  pick(shape.equality_rows, in.equality, stage.equality_value.data());
  pick(shape.initial_links, in.link, stage.equality_value.data() + shape.equality_rows.size());
  pick(shape.link_rows, in.link, stage.link_value.data());

  if (knot == horizon_) return;
  in.local_entry = -1;
  for (int entry : shape.local_dynamics)
    if (std::abs(derivatives.dynamics[static_cast<std::size_t>(entry)]) > 0.0)
      in.local_entry = entry;
  write(shape.dynamics, derivatives.dynamics, stage.dynamics);
  write(shape.implicit, derivatives.implicit, stage.implicit);
  std::copy(in.defect.begin(), in.defect.end(), stage.offset.data());
  // A carried block's rows: its coordinates here minus those at the next knot.
  const ColumnMap& next = shapes_[static_cast<std::size_t>(knot + 1)]->columns;
  const auto& blocks = problem_->blocks();
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const int row = next.first_column(static_cast<int>(b));
    if (row < problem_->ndx() || row >= next.nx) continue;
    for (int i = 0; i < next.column_count(static_cast<int>(b)); ++i)
      stage.offset[row + i] =
          trajectory(knot, blocks[b].offset + i) - trajectory(knot + 1, blocks[b].offset + i);
  }
}

NonFinite Transcription::linearize(const RowMatrix& trajectory) {
  resolve_shapes();
  pool_.parallel_for(horizon_ + 1, [&](int thread, int knot) {
    evaluate_knot(thread, knot, trajectory, true);
    fill_stage(thread, knot, trajectory);
  });
  refuse_locals_in_dynamics();
  update_initial_state(trajectory);
  // Derivatives are not looked at here, for speed: a QP back end refuses what is not finite.
  for (int k = 0; k <= horizon_; ++k)
    if (!has_finite_values(k)) return find_non_finite();
  return {};
}

void Transcription::update_initial_state(const RowMatrix& trajectory) {
  state_difference(*problem_, measured_.data(), trajectory.row(0).data(), qp_.initial_state.data());
}

const double* Transcription::slopes(int knot) const {
  return buffers_[static_cast<std::size_t>(knot)].slopes.data();
}

Evaluation Transcription::evaluate(const RowMatrix& trajectory) {
  resolve_shapes();
  pool_.parallel_for(horizon_ + 1,
                     [&](int thread, int knot) { evaluate_knot(thread, knot, trajectory, false); });
  return summarize();
}

Evaluation Transcription::summarize() const {
  Evaluation total;
  double squared = 0.0;
  auto residual = [&](double value) {
    total.equality_max = std::max(total.equality_max, std::abs(value));
    squared += value * value;
  };
  for (int k = 0; k <= horizon_; ++k) {
    const KnotShape& shape = *shapes_[static_cast<std::size_t>(k)];
    const KnotBuffers& out = buffers_[static_cast<std::size_t>(k)];
    const QpStage& stage = qp_.stages[static_cast<std::size_t>(k)];
    total.cost += out.cost;
    const double* vanishes = vanishes_until_[static_cast<int>(shape.signature.stage)].data();
    for (std::size_t i = 0; i < shape.penalty_rows.size(); ++i) {
      const int row = shape.penalty_rows[i];
      const double h = out.inequality[static_cast<std::size_t>(row)];
      if (h <= vanishes[row]) continue;
      total.penalty += evaluate_penalty(stage.penalty_policy[i], h).value;
    }
    for (int row : shape.inequality_rows) {
      const double h = out.inequality[static_cast<std::size_t>(row)];
      total.inequality_max = std::max(total.inequality_max, h);
      if (h > 0.0) squared += h * h;
    }
    for (int row : shape.equality_rows) residual(out.equality[static_cast<std::size_t>(row)]);
    for (int row : shape.initial_links) residual(out.link[static_cast<std::size_t>(row)]);
    for (int row : shape.link_rows) residual(out.link[static_cast<std::size_t>(row)]);
    if (k == horizon_) continue;
    const Eigen::Map<const Eigen::VectorXd> defect(out.defect.data(), problem_->ndx());
    if (defect.size() > 0)
      total.equality_max = std::max(total.equality_max, defect.lpNorm<Eigen::Infinity>());
    squared += defect.squaredNorm();
  }
  total.infeasibility = std::sqrt(squared);
  total.is_finite = std::isfinite(total.total()) && std::isfinite(total.infeasibility);
  return total;
}

}  // namespace palanquin
