// Evaluating and linearising all knots: the lowered functions are called per knot, in parallel when
// the pool has more than one thread, and gathered into the stage QP.

#include <algorithm>
#include <cmath>

#include "knot_buffers.hpp"
#include "palanquin/core/manifold.hpp"
#include "palanquin/core/transcription.hpp"

namespace palanquin {

/// The terminal knot has neither a next state nor its two Jacobians.
Transcription::KnotResult Transcription::terminal_result(int result) {
  return static_cast<KnotResult>(result < 3 ? result + 1 : result + 3);
}

/// Evaluates all knots in parallel, running ones in groups of as many as a lowered function has
/// lanes; with `linear` fills the stages too.
void Transcription::evaluate_knots(const RowMatrix& trajectory, bool linear) {
  resolve_shapes();
  const auto& functions = linear ? problem_->knot_derivatives : problem_->knot_values;
  const int lanes = functions[0].lanes();
  const int groups = (horizon_ + lanes - 1) / lanes;
  pool_.parallel_for(groups + 1, [&](int thread, int group) {
    const bool terminal = group == groups;
    const int first = terminal ? horizon_ : group * lanes;
    const int last = terminal ? horizon_ + 1 : std::min(first + lanes, horizon_);
    for (int knot = first; linear && knot < last; ++knot) evaluate_chart(thread, knot, trajectory);
    evaluate_group(thread, first, last, trajectory, functions[terminal ? 1 : 0]);
    for (int knot = first; knot < last; ++knot) {
      if (!terminal) evaluate_defect(knot, trajectory);
      evaluate_link(thread, knot, trajectory, linear);
      if (linear) fill_values(knot, trajectory);
    }
  });
}

/// Evaluates knots [first, last), which are at most as many as `function` has lanes, and passes on
/// its results.
void Transcription::evaluate_group(int thread, int first, int last, const RowMatrix& trajectory,
                                   const LaneFunction& function) {
  FunctionWorkspace& w = workspaces_[static_cast<std::size_t>(thread)];
  const bool terminal = first == horizon_;
  const int lanes = function.lanes();
  for (int lane = 0; lane < lanes; ++lane) {
    const int knot = std::min(first + lane, last - 1);  // the last one fills up
    int argument = lane;
    const auto give = [&](const double* values) {
      w.arguments[static_cast<std::size_t>(argument)] = values;
      argument += lanes;
    };
    give(trajectory.row(knot).data());
    if (!terminal) give(trajectory.row(knot + 1).data());
    give(parameters_at(knot));
  }
  function(w, [&](int result, const double* values) {
    const KnotResult kind = terminal ? terminal_result(result) : static_cast<KnotResult>(result);
    for (int knot = first; knot < last; ++knot) take(knot, kind, values + (knot - first), lanes);
  });
}

/// Puts one result of a knot, whose values are `stride` apart, where it belongs.
void Transcription::take(int knot, KnotResult result, const double* values, int stride) {
  const KnotShape& shape = *shapes_[static_cast<std::size_t>(knot)];
  KnotBuffers& out = buffers_[static_cast<std::size_t>(knot)];
  QpStage& stage = qp_.stages[static_cast<std::size_t>(knot)];
  const auto copy = [&](std::vector<double>& target, int count) {
    const double* value = values;
    for (int i = 0; i < count; ++i, value += stride) target[size_of(i)] = *value;
  };
  const auto rows = [&](RowKind kind) { return problem_->row_count(shape.signature.stage, kind); };
  const auto write = [&](const Gather& recipe, double* target) {
    recipe.write(values, out.slopes.data(), target);
  };
  switch (result) {
    case KnotResult::NextState:
      return copy(out.next_state, problem_->nx());
    case KnotResult::Cost:
      out.cost = *values;
      return;
    case KnotResult::Equality:
      return copy(out.equality, rows(RowKind::Equality));
    case KnotResult::Inequality:
      return copy(out.inequality, rows(RowKind::Inequality));
    case KnotResult::Dynamics:
      out.local_entry = -1;
      for (int entry : shape.local_dynamics)
        if (std::abs(values[entry * stride]) > 0.0) out.local_entry = entry;
      return write(shape.dynamics, stage.dynamics.values.data());
    case KnotResult::Implicit:
      return write(shape.implicit, stage.implicit.values.data());
    case KnotResult::Gradient:
      return write(shape.gradient, stage.gradient.data());
    case KnotResult::Hessian:
      return write(shape.hessian, stage.hessian.values.data());
    case KnotResult::EqualityJacobian:
      return write(shape.equality, stage.equality_jacobian.values.data());
    case KnotResult::InequalityJacobian:
      write(shape.penalty, stage.penalty_jacobian.values.data());
      return write(shape.inequality, stage.inequality_jacobian.values.data());
  }
}

/// Slopes of the charts, where blocks are charted.
void Transcription::evaluate_chart(int thread, int knot, const RowMatrix& trajectory) {
  const auto& charted = shapes_[static_cast<std::size_t>(knot)]->signature.charted;
  if (std::none_of(charted.begin(), charted.end(), [](char c) { return c != 0; })) return;
  FunctionWorkspace& w = workspaces_[static_cast<std::size_t>(thread)];
  KnotBuffers& out = buffers_[static_cast<std::size_t>(knot)];
  w.arguments[0] = trajectory.row(knot).data();
  w.arguments[1] = parameters_at(knot);
  w.results[0] = thread_buffers_[static_cast<std::size_t>(thread)].embedded.data();
  w.results[1] = out.slopes.data();
  problem_->chart(w);
}

/// Link rows, where there are some.
void Transcription::evaluate_link(int thread, int knot, const RowMatrix& trajectory, bool linear) {
  const KnotShape& shape = *shapes_[static_cast<std::size_t>(knot)];
  if (shape.link_rows.empty() && shape.initial_links.empty()) return;
  FunctionWorkspace& w = workspaces_[static_cast<std::size_t>(thread)];
  KnotBuffers& out = buffers_[static_cast<std::size_t>(knot)];
  ThreadBuffers& jacobians = thread_buffers_[static_cast<std::size_t>(thread)];
  w.arguments[0] = knot > 0 ? trajectory.row(knot - 1).data() : measured_.data();
  w.arguments[1] = trajectory.row(knot).data();
  w.arguments[2] = parameters_at(knot);
  w.results[0] = out.link.data();
  w.results[1] = jacobians.link_previous.data();
  w.results[2] = jacobians.link.data();
  (linear ? problem_->link_linear : problem_->link)(w);
  if (!linear) return;
  QpStage& stage = qp_.stages[static_cast<std::size_t>(knot)];
  const double *previous = jacobians.link_previous.data(), *own = jacobians.link.data();
  const double* slopes = out.slopes.data();
  shape.initial_link.add(own, slopes, stage.equality_jacobian.values.data());
  shape.link_previous.write(previous, slopes, stage.link_previous.values.data());
  shape.link.write(own, slopes, stage.link_jacobian.values.data());
}

/// Residual d (-) x_{k+1} of the knot's dynamics [ndx].
void Transcription::evaluate_defect(int knot, const RowMatrix& trajectory) {
  KnotBuffers& out = buffers_[static_cast<std::size_t>(knot)];
  const double* next = trajectory.row(knot + 1).data();
  const double* d = out.next_state.data();
  double* rows = out.defect.data();
  for (const BlockInfo& b : problem_->states()) {
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

/// Values of the stage's rows, from those of the lowered functions.
void Transcription::fill_values(int knot, const RowMatrix& trajectory) {
  const KnotShape& shape = *shapes_[static_cast<std::size_t>(knot)];
  const KnotBuffers& in = buffers_[static_cast<std::size_t>(knot)];
  QpStage& stage = qp_.stages[static_cast<std::size_t>(knot)];
  auto pick = [](const std::vector<int>& rows, const std::vector<double>& source, double* target) {
    for (std::size_t i = 0; i < rows.size(); ++i)
      target[i] = source[static_cast<std::size_t>(rows[i])];
  };
  pick(shape.penalty_rows, in.inequality, stage.penalty_value.data());
  pick(shape.inequality_rows, in.inequality, stage.inequality_value.data());
  pick(shape.equality_rows, in.equality, stage.equality_value.data());
  pick(shape.initial_links, in.link, stage.equality_value.data() + shape.equality_rows.size());
  pick(shape.link_rows, in.link, stage.link_value.data());

  if (knot == horizon_) return;
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
  evaluate_knots(trajectory, true);
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
  evaluate_knots(trajectory, false);
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
