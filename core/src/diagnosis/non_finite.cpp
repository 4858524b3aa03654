// Telling which function, row and knot a value that is not finite belongs to.

#include "palanquin/core/diagnosis/non_finite.hpp"

#include <array>
#include <cmath>
#include <tuple>
#include <utility>
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

/// The lowered function that gives rows of a kind, or what a stage has besides.
std::string function_of(StageKind stage, RowKind kind = RowKind::Equality) {
  if (kind == RowKind::Link) return "link";
  return stage == StageKind::Running ? "running" : "terminal";
}

NonFinite report(const std::string& what, const std::string& function, int knot) {
  return {true, "function '" + function + "' is not finite in " + what, function, what, knot};
}

NonFinite report_derivative(const std::string& what, const std::string& function, int knot) {
  return report("the derivative of " + what, function + "_linear", knot);
}

NonFinite name_derivative(const LoweredProblem& problem, const QpStage& stage, const KnotRows& rows,
                          int knot) {
  std::vector<std::pair<int, RowKind>> equalities;  // link rows of one knot are behind the others
  equalities.reserve(rows.equality_rows.size() + rows.own_links.size());
  for (int row : rows.equality_rows) equalities.emplace_back(row, RowKind::Equality);
  for (int row : rows.own_links) equalities.emplace_back(row, RowKind::Link);
  const auto in_order = [](const std::vector<int>& indices, RowKind kind) {
    std::vector<std::pair<int, RowKind>> named;
    named.reserve(indices.size());
    for (int row : indices) named.emplace_back(row, kind);
    return named;
  };
  const auto penalties = in_order(rows.penalty_rows, RowKind::Inequality);
  const auto hard = in_order(rows.inequality_rows, RowKind::Inequality);
  const auto links = in_order(rows.link_rows, RowKind::Link);
  using Block = std::pair<const SparseBlock*, const std::vector<std::pair<int, RowKind>>*>;
  for (const auto& [block, names] :
       {Block{&stage.penalty_jacobian, &penalties}, Block{&stage.inequality_jacobian, &hard},
        Block{&stage.equality_jacobian, &equalities}, Block{&stage.link_jacobian, &links},
        Block{&stage.link_previous, &links}})
    for (std::size_t n = 0; n < block->values.size(); ++n)
      if (!std::isfinite(block->values[n])) {
        const auto& [row, kind] = (*names)[size_of(block->row_index[n])];
        return report_derivative(problem.row_name(rows.stage, kind, row, knot),
                                 function_of(rows.stage, kind), knot);
      }
  const bool in_cost = !all_finite(stage.gradient) || !all_finite(stage.hessian.values);
  const char* what = in_cost ? "the cost" : "the dynamics";
  return report_derivative(what + at_knot(knot), function_of(rows.stage), knot);
}

NonFinite name_value(const LoweredProblem& problem, const QpStage& stage, const KnotRows& rows,
                     const KnotValues& values, int knot) {
  if (rows.stage == StageKind::Running)
    for (std::size_t row = 0; row < values.next_state.size(); ++row)
      if (!std::isfinite(values.next_state[row]))
        return report(problem.dynamics_name(static_cast<int>(row), knot), "running", knot);
  if (!std::isfinite(values.cost))
    return report("the cost" + at_knot(knot), function_of(rows.stage), knot);
  const std::array<std::tuple<const std::vector<int>*, const std::vector<double>*, RowKind>, 5>
      groups = {{{&rows.penalty_rows, &values.inequality, RowKind::Inequality},
                 {&rows.inequality_rows, &values.inequality, RowKind::Inequality},
                 {&rows.equality_rows, &values.equality, RowKind::Equality},
                 {&rows.link_rows, &values.link, RowKind::Link},
                 {&rows.own_links, &values.link, RowKind::Link}}};
  for (const auto& [of_rows, of_kind, kind] : groups)
    for (int row : *of_rows)
      if (!std::isfinite((*of_kind)[size_of(row)]))
        return report(problem.row_name(rows.stage, kind, row, knot), function_of(rows.stage, kind),
                      knot);
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
