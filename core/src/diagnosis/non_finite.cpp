// Telling which function, row and knot a value that is not finite belongs to.

#include "palanquin/core/diagnosis/non_finite.hpp"

#include <array>
#include <cmath>
#include <tuple>
#include <vector>

#include "palanquin/core/finite.hpp"
#include "transcription/sizes.hpp"

namespace palanquin {

namespace {

bool has_finite_values(const QpStage& stage, const KnotValues& values) {
  return std::isfinite(values.cost) && all_finite(stage.offset) && all_finite(stage.gradient) &&
         all_finite(stage.penalty_value) && all_finite(stage.inequality_value) &&
         all_finite(stage.equality_value) && all_finite(stage.link_value);
}

bool has_finite_derivatives(const QpStage& stage) {
  return all_finite(stage.gradient) && all_finite(stage.hessian.values) &&
         all_finite(stage.penalty_jacobian.values) &&
         all_finite(stage.inequality_jacobian.values) &&
         all_finite(stage.equality_jacobian.values) && all_finite(stage.link_jacobian.values) &&
         all_finite(stage.link_previous.values) && all_finite(stage.dynamics.values) &&
         all_finite(stage.implicit.values);
}

std::string at_knot(int knot) { return " (knot " + std::to_string(knot) + ")"; }

NonFinite report(const std::string& where, StageKind stage, const char* suffix = "") {
  const std::string function = stage == StageKind::Running ? "running" : "terminal";
  return {true, "function '" + function + suffix + "' is not finite in " + where};
}

NonFinite name_derivative(const LoweredProblem& problem, const QpStage& stage, const KnotRows& rows,
                          int knot) {
  const std::array<std::tuple<const SparseBlock*, const std::vector<int>*, RowKind>, 3> blocks = {
      {{&stage.penalty_jacobian, &rows.penalty_rows, RowKind::Inequality},
       {&stage.inequality_jacobian, &rows.inequality_rows, RowKind::Inequality},
       {&stage.link_jacobian, &rows.link_rows, RowKind::Link}}};
  for (const auto& [block, of_rows, kind] : blocks)
    for (std::size_t n = 0; n < block->values.size(); ++n)
      if (!std::isfinite(block->values[n])) {
        const int row = (*of_rows)[size_of(block->row_index[n])];
        return report("the derivative of " + problem.row_name(rows.stage, kind, row, knot),
                      rows.stage, "_linear");
      }
  const bool in_cost = !all_finite(stage.gradient) || !all_finite(stage.hessian.values);
  const char* what = in_cost ? "the cost" : "the dynamics or rows";
  return report("the derivative of " + std::string(what) + at_knot(knot), rows.stage, "_linear");
}

NonFinite name_value(const LoweredProblem& problem, const QpStage& stage, const KnotRows& rows,
                     const KnotValues& values, int knot) {
  if (rows.stage == StageKind::Running)
    for (std::size_t row = 0; row < values.next_state.size(); ++row)
      if (!std::isfinite(values.next_state[row]))
        return report(problem.dynamics_name(static_cast<int>(row), knot), rows.stage);
  if (!std::isfinite(values.cost)) return report("the cost" + at_knot(knot), rows.stage);
  const std::array<std::tuple<const std::vector<int>*, const std::vector<double>*, RowKind>, 5>
      groups = {{{&rows.penalty_rows, &values.inequality, RowKind::Inequality},
                 {&rows.inequality_rows, &values.inequality, RowKind::Inequality},
                 {&rows.equality_rows, &values.equality, RowKind::Equality},
                 {&rows.link_rows, &values.link, RowKind::Link},
                 {&rows.own_links, &values.link, RowKind::Link}}};
  for (const auto& [of_rows, of_kind, kind] : groups)
    for (int row : *of_rows)
      if (!std::isfinite((*of_kind)[size_of(row)]))
        return report(problem.row_name(rows.stage, kind, row, knot), rows.stage);
  return name_derivative(problem, stage, rows, knot);
}

}  // namespace

NonFinite find_non_finite_value(const TranscriptionWorkspace& workspace) {
  for (int k = 0; k <= workspace.horizon(); ++k) {
    const QpStage& stage = workspace.qp().stages[size_of(k)];
    const KnotValues& values = workspace.values(k);
    if (!has_finite_values(stage, values))
      return name_value(workspace.problem(), stage, workspace.shape(k), values, k);
  }
  return {};
}

NonFinite find_non_finite_derivative(const TranscriptionWorkspace& workspace) {
  for (int k = 0; k <= workspace.horizon(); ++k) {
    const QpStage& stage = workspace.qp().stages[size_of(k)];
    if (!has_finite_derivatives(stage))
      return name_derivative(workspace.problem(), stage, workspace.shape(k), k);
  }
  return {};
}

}  // namespace palanquin
