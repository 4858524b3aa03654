#include "transcription/linearization.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "palanquin/core/manifold.hpp"

namespace palanquin {

Linearization::ThreadBuffers::ThreadBuffers(const LoweredProblem& problem)
    : link_previous(size_of(problem.link_linear.result(1).nnz())),
      link(size_of(problem.link_linear.result(2).nnz())),
      embedded(size_of(problem.nz())),
      unused_slopes(size_of(problem.chart.result(1).nnz())) {}

Linearization::Linearization(const TranscriptionModel& model, int threads)
    : model_(model),
      slopes_(size_of(model.horizon() + 1),
              std::vector<double>(size_of(model.problem().chart.result(1).nnz()))),
      local_entry_(slopes_.size(), -1),
      thread_buffers_(size_of(threads), ThreadBuffers(model.problem())) {
  if (model.exact() != nullptr)
    exact_buffers_.assign(slopes_.size(), ExactBuffers(model.problem(), *model.exact()));
}

void Linearization::evaluate(const TranscriptionInputs& inputs, const RowMatrix& trajectory,
                             KnotFunctions& functions, StageStore& stages) {
  evaluate_charts(inputs, trajectory, stages, functions.workspace());
  functions.for_each_group([&](int thread, int first, int last) {
    functions.call(thread, first, last, inputs, trajectory, model_.problem().knot_derivatives,
                   [&](int knot, KnotResult result, const double* values, int stride) {
                     if (is_value(result))
                       functions.keep(knot, result, values, stride);
                     else
                       gather(knot, result, values, stride, stages.shape(knot), stages.stage(knot));
                   });
    for (int knot = first; knot < last; ++knot) {
      if (knot < model_.horizon()) functions.evaluate_defect(knot, trajectory);
      evaluate_link(thread, knot, inputs, trajectory, functions, stages);
      fill_values(knot, trajectory, functions.values()[size_of(knot)], stages);
    }
  });
  refuse_locals_in_dynamics();
}

// ---- charts -----------------------------------------------------------------------------------

/// Slopes of the charts: where a block is free on its chart its own, while it is carried on those
/// of the knot before, whatever the chart is by now.
void Linearization::evaluate_charts(const TranscriptionInputs& inputs, const RowMatrix& trajectory,
                                    const StageStore& stages, FunctionWorkspace& w) {
  for (int knot = 0; knot <= model_.horizon(); ++knot) {
    const KnotShape& shape = stages.shape(knot);
    double* slopes = slopes_[size_of(knot)].data();
    if (!shape.charted.empty()) {
      w.arguments[0] = trajectory.row(knot).data();
      w.arguments[1] = inputs.parameters().row(knot).data();
      w.results[0] = thread_buffers_.front().embedded.data();
      w.results[1] = slopes;
      model_.problem().chart(w);
    }
    for (const KnotShape::Entries& held : shape.held_slopes)
      std::copy_n(slopes_[size_of(knot - 1)].data() + held.offset, held.size, slopes + held.offset);
  }
}

void Linearization::embed(const TranscriptionInputs& inputs, const KnotShape& shape, int knot,
                          RowMatrix& trajectory, FunctionWorkspace& w) {
  if (shape.charted.empty()) return;
  ThreadBuffers& out = thread_buffers_.front();
  double* z = trajectory.row(knot).data();
  w.arguments[0] = z;
  w.arguments[1] = inputs.parameters().row(knot).data();
  w.results[0] = out.embedded.data();
  w.results[1] = out.unused_slopes.data();
  model_.problem().chart(w);
  for (const KnotShape::Entries& block : shape.charted)
    for (int i = block.offset; i < block.offset + block.size; ++i) z[i] = out.embedded[size_of(i)];
}

// ---- derivatives ------------------------------------------------------------------------------

/// Puts one derivative of a knot, whose values are `stride` apart, where it belongs.
void Linearization::gather(int knot, KnotResult result, const double* values, int stride,
                           const KnotShape& shape, QpStage& stage) {
  const auto write = [&](const Gather& recipe, double* target) {
    recipe.write(values, slopes_[size_of(knot)].data(), target);
  };
  int& local_entry = local_entry_[size_of(knot)];
  switch (result) {
    case KnotResult::Dynamics:
      local_entry = -1;
      for (int entry : shape.local_dynamics)
        if (std::abs(values[entry * stride]) > 0.0) local_entry = entry;
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
    default:  // values, which KnotFunctions keeps
      return;
  }
}

/// Link rows, where there are some.
void Linearization::evaluate_link(int thread, int knot, const TranscriptionInputs& inputs,
                                  const RowMatrix& trajectory, KnotFunctions& functions,
                                  StageStore& stages) {
  const KnotShape& shape = stages.shape(knot);
  if (shape.link_rows.empty() && shape.own_links.empty()) return;
  ThreadBuffers& jacobians = thread_buffers_[size_of(thread)];
  FunctionWorkspace& w = functions.workspace(thread);
  functions.give_link(thread, knot, inputs, trajectory);
  w.results[1] = jacobians.link_previous.data();
  w.results[2] = jacobians.link.data();
  model_.problem().link_linear(w);
  QpStage& stage = stages.stage(knot);
  const double *previous = jacobians.link_previous.data(), *own = jacobians.link.data();
  const double* slopes = slopes_[size_of(knot)].data();
  shape.own_link.add(own, slopes, stage.equality_jacobian.values.data());
  if (knot == 0) return;
  const double* slopes_before = slopes_[size_of(knot - 1)].data();
  shape.remembered_link.add(previous, slopes_before, stage.equality_jacobian.values.data());
  shape.link_previous.write(previous, slopes_before, stage.link_previous.values.data());
  shape.link.write(own, slopes, stage.link_jacobian.values.data());
}

/// Values of the stage's rows, from those of the lowered functions.
void Linearization::fill_values(int knot, const RowMatrix& trajectory, const KnotValues& in,
                                StageStore& stages) const {
  const KnotShape& shape = stages.shape(knot);
  QpStage& stage = stages.stage(knot);
  auto pick = [](const std::vector<int>& rows, const std::vector<double>& source, double* target) {
    for (std::size_t i = 0; i < rows.size(); ++i) target[i] = source[size_of(rows[i])];
  };
  pick(shape.penalty_rows, in.inequality, stage.penalty_value.data());
  pick(shape.inequality_rows, in.inequality, stage.inequality_value.data());
  pick(shape.equality_rows, in.equality, stage.equality_value.data());
  pick(shape.own_links, in.link, stage.equality_value.data() + shape.equality_rows.size());
  pick(shape.link_rows, in.link, stage.link_value.data());

  if (knot == model_.horizon()) return;
  std::copy(in.defect.begin(), in.defect.end(), stage.offset.data());
  // A carried block's rows: its coordinates here minus those at the next knot.
  const ColumnMap& next = stages.shape(knot + 1).columns;
  const auto& blocks = model_.problem().blocks();
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const int row = next.first_column(static_cast<int>(b));
    if (row < model_.problem().ndx() || row >= next.nx) continue;
    for (int i = 0; i < next.column_count(static_cast<int>(b)); ++i)
      stage.offset[row + i] =
          trajectory(knot, blocks[b].offset + i) - trajectory(knot + 1, blocks[b].offset + i);
  }
}

void Linearization::refuse_locals_in_dynamics() const {
  for (int k = 0; k < model_.horizon(); ++k) {
    const int entry = local_entry_[size_of(k)];
    if (entry < 0) continue;
    const Sparsity& pattern = model_.problem().running_linear.result(4);
    int column = 0;
    while (pattern.column_start[size_of(column + 1)] <= entry) ++column;
    const auto& blocks = model_.problem().blocks();
    const auto block = std::find_if(blocks.begin(), blocks.end(), [&](const BlockInfo& b) {
      return column < b.tangent_offset + b.tangent_size;
    });
    throw std::invalid_argument("block '" + block->name + "' is local at knot " +
                                std::to_string(k) +
                                ", but the dynamics depend on it there; make it an input");
  }
}

}  // namespace palanquin
