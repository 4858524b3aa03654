// Telling which row of which constraint a number belongs to: non-finite values and violations.

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "knot_buffers.hpp"
#include "palanquin/core/finite.hpp"
#include "palanquin/core/transcription.hpp"

namespace palanquin {

bool Transcription::has_finite_values(int knot) const {
  const auto i = static_cast<std::size_t>(knot);
  const QpStage& stage = qp_.stages[i];
  return std::isfinite(buffers_[i].cost) && all_finite(stage.offset) &&
         all_finite(stage.gradient) && all_finite(stage.penalty_value) &&
         all_finite(stage.inequality_value) && all_finite(stage.equality_value) &&
         all_finite(stage.link_value);
}

bool Transcription::has_finite_derivatives(int knot) const {
  const QpStage& stage = qp_.stages[static_cast<std::size_t>(knot)];
  return all_finite(stage.hessian.values) && all_finite(stage.penalty_jacobian.values) &&
         all_finite(stage.inequality_jacobian.values) &&
         all_finite(stage.equality_jacobian.values) && all_finite(stage.link_jacobian.values) &&
         all_finite(stage.link_previous.values) && all_finite(stage.dynamics.values) &&
         all_finite(stage.implicit.values);
}

NonFinite Transcription::find_non_finite() const {
  auto report = [](const std::string& where, const std::string& function) {
    return NonFinite{true, "function '" + function + "' is not finite in " + where};
  };
  for (int k = 0; k <= horizon_; ++k) {
    if (has_finite_values(k) && has_finite_derivatives(k)) continue;
    const auto i = static_cast<std::size_t>(k);
    const QpStage& stage = qp_.stages[i];
    const KnotShape& shape = *shapes_[i];
    const KnotBuffers& out = buffers_[i];
    const StageKind kind = shape.signature.stage;
    const std::string function = kind == StageKind::Running ? "running" : "terminal";
    const std::string at_knot = " (knot " + std::to_string(k) + ")";
    if (kind == StageKind::Running)
      for (std::size_t row = 0; row < out.next_state.size(); ++row)
        if (!std::isfinite(out.next_state[row]))
          return report(problem_->dynamics_name(static_cast<int>(row), k), function);
    if (!std::isfinite(out.cost)) return report("the cost" + at_knot, function);
    auto first_bad = [&](const std::vector<int>& rows, const std::vector<double>& values) {
      for (int row : rows)
        if (!std::isfinite(values[static_cast<std::size_t>(row)])) return row;
      return -1;
    };
    const std::array<std::tuple<const std::vector<int>*, const std::vector<double>*, RowKind>, 5>
        groups = {{{&shape.penalty_rows, &out.inequality, RowKind::Inequality},
                   {&shape.inequality_rows, &out.inequality, RowKind::Inequality},
                   {&shape.equality_rows, &out.equality, RowKind::Equality},
                   {&shape.link_rows, &out.link, RowKind::Link},
                   {&shape.initial_links, &out.link, RowKind::Link}}};
    for (const auto& [rows, values, row_kind] : groups)
      if (const int row = first_bad(*rows, *values); row >= 0)
        return report(problem_->row_name(kind, row_kind, row, k), function);

    auto name_column = [&](const SparseBlock& block, const std::vector<int>& rows, RowKind row_kind,
                           NonFinite& found) {
      for (std::size_t n = 0; n < block.values.size() && !found.found; ++n)
        if (!std::isfinite(block.values[n]))
          found =
              report("the derivative of " +
                         problem_->row_name(kind, row_kind,
                                            rows[static_cast<std::size_t>(block.row_index[n])], k),
                     function + "_linear");
    };
    NonFinite found;
    name_column(stage.penalty_jacobian, shape.penalty_rows, RowKind::Inequality, found);
    name_column(stage.inequality_jacobian, shape.inequality_rows, RowKind::Inequality, found);
    name_column(stage.link_jacobian, shape.link_rows, RowKind::Link, found);
    if (found.found) return found;
    const bool in_cost = !all_finite(stage.gradient) || !all_finite(stage.hessian.values);
    return report(
        (in_cost ? "the derivative of the cost" : "the derivative of the dynamics or rows") +
            at_knot,
        function + "_linear");
  }
  return {};
}

std::map<std::string, double> Transcription::violations(const RowMatrix& trajectory) {
  evaluate(trajectory);
  std::map<std::string, double> worst;
  for (int k = 0; k <= horizon_; ++k) {
    const KnotShape& shape = *shapes_[static_cast<std::size_t>(k)];
    const KnotBuffers& out = buffers_[static_cast<std::size_t>(k)];
    const auto& groups = problem_->rows(shape.signature.stage, RowKind::Inequality);
    for (std::size_t g = 0; g < groups.size(); ++g) {
      double& entry = worst[groups[g].family];
      if (!shape.signature.active[1][g]) continue;
      for (int i = 0; i < groups[g].size; ++i)
        entry = std::max(entry, groups[g].scale *
                                    out.inequality[static_cast<std::size_t>(groups[g].offset + i)]);
    }
  }
  return worst;
}

void Transcription::refuse_locals_in_dynamics() const {
  for (int k = 0; k < horizon_; ++k) {
    const int entry = buffers_[static_cast<std::size_t>(k)].local_entry;
    if (entry < 0) continue;
    const Sparsity& pattern = problem_->running_linear.result(4);
    int column = 0;
    while (pattern.column_start[static_cast<std::size_t>(column + 1)] <= entry) ++column;
    const auto block = std::find_if(
        problem_->blocks().begin(), problem_->blocks().end(),
        [&](const BlockInfo& b) { return column < b.tangent_offset + b.tangent_size; });
    throw std::invalid_argument("block '" + block->name + "' is local at knot " +
                                std::to_string(k) +
                                ", but the dynamics depend on it there; make it an input");
  }
}

std::vector<RowViolation> Transcription::worst_rows(const RowMatrix& trajectory, int count) {
  evaluate(trajectory);
  std::vector<RowViolation> rows;
  for (int k = 0; k <= horizon_; ++k) {
    const KnotShape& shape = *shapes_[static_cast<std::size_t>(k)];
    const KnotBuffers& out = buffers_[static_cast<std::size_t>(k)];
    const StageKind kind = shape.signature.stage;
    auto add = [&](const std::vector<int>& indices, const std::vector<double>& values,
                   RowKind row_kind, bool one_sided) {
      for (int row : indices) {
        const double value = values[static_cast<std::size_t>(row)];
        const double violation = one_sided ? value : std::abs(value);
        if (violation > 0.0)
          rows.push_back({problem_->row_name(kind, row_kind, row, k), violation});
      }
    };
    add(shape.penalty_rows, out.inequality, RowKind::Inequality, true);
    add(shape.inequality_rows, out.inequality, RowKind::Inequality, true);
    add(shape.equality_rows, out.equality, RowKind::Equality, false);
    add(shape.link_rows, out.link, RowKind::Link, false);
    add(shape.initial_links, out.link, RowKind::Link, false);
    if (k == horizon_) continue;
    std::size_t row = 0;
    for (const BlockInfo& b : problem_->states()) {
      for (int i = 0; i < b.tangent_size; ++i, ++row)
        if (out.defect[row] != 0.0)
          rows.push_back({"dynamics of " + b.name + "[" + std::to_string(i) + "] (knot " +
                              std::to_string(k) + ")",
                          std::abs(out.defect[row])});
    }
  }
  const auto kept = std::min(rows.size(), static_cast<std::size_t>(std::max(count, 0)));
  std::partial_sort(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(kept), rows.end(),
                    [](const RowViolation& a, const RowViolation& b) { return a.value > b.value; });
  rows.resize(kept);
  return rows;
}

std::string Transcription::describe_worst_rows(const RowMatrix& trajectory) {
  std::ostringstream text;
  for (const RowViolation& row : worst_rows(trajectory, 3))
    text << (text.tellp() == 0 ? "worst: " : ", ") << row.name << ' ' << row.value;
  return text.str();
}

}  // namespace palanquin
