#include "palanquin/core/diagnosis/violations.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "palanquin/core/finite.hpp"
#include "transcription/knot_functions.hpp"
#include "transcription/roles.hpp"

namespace palanquin {

namespace {

/// The rows of all knots and the values of a trajectory, apart from any solver.
class TrajectoryValues {
 public:
  TrajectoryValues(const TranscriptionModel& model, const TranscriptionInputs& inputs,
                   const RowMatrix& trajectory)
      : roles_(model), functions_(model, 1) {
    model.check_trajectory(trajectory);
    roles_.read(inputs, functions_.workspace());
    roles_.resolve(inputs.policies());
    const auto& signatures = roles_.signatures();
    own_.reserve(signatures.size());
    for (std::size_t k = 0; k < signatures.size(); ++k) {
      own_.emplace_back(model.problem(), *signatures[k], k > 0);
      rows_.push_back(&own_.back());
    }
    functions_.evaluate(inputs, rows_, trajectory);
  }

  const std::vector<const KnotRows*>& rows() const { return rows_; }
  const std::vector<KnotValues>& values() const { return functions_.values(); }

 private:
  KnotRoles roles_;
  KnotFunctions functions_;
  std::vector<KnotRows> own_;
  std::vector<const KnotRows*> rows_;
};

/// The group of a row.
const RowGroup& group_of(const std::vector<RowGroup>& groups, int row) {
  return *std::find_if(groups.begin(), groups.end(),
                       [&](const RowGroup& g) { return row < g.offset + g.size; });
}

/// The residuals of one knot that are not zero, by name.
void add_residuals(const LoweredProblem& problem, const KnotRows& rows, const KnotValues& values,
                   int knot, std::vector<RowViolation>& residuals) {
  const auto add = [&](const std::vector<int>& indices, const std::vector<double>& of_rows,
                       RowKind kind, bool one_sided) {
    for (int row : indices) {
      const double value = of_rows[size_of(row)];
      const double violation = one_sided ? value : std::abs(value);
      if (violation <= 0.0) continue;
      const RowGroup& g = group_of(problem.rows(rows.stage, kind), row);
      residuals.push_back({problem.row_name(rows.stage, kind, row, knot), violation, g.family,
                           g.robot, g.limb, row - g.offset, knot, g.scale,
                           kind == RowKind::Inequality});
    }
  };
  add(rows.penalty_rows, values.inequality, RowKind::Inequality, true);
  add(rows.inequality_rows, values.inequality, RowKind::Inequality, true);
  add(rows.equality_rows, values.equality, RowKind::Equality, false);
  add(rows.link_rows, values.link, RowKind::Link, false);
  add(rows.own_links, values.link, RowKind::Link, false);
  if (rows.stage == StageKind::Terminal) return;
  std::size_t row = 0;
  for (const BlockInfo& b : problem.states())
    for (int i = 0; i < b.tangent_size; ++i, ++row)
      if (values.defect[row] != 0.0) {
        const std::string family = "dynamics of " + b.name;
        residuals.push_back(
            {family + "[" + std::to_string(i) + "] (knot " + std::to_string(knot) + ")",
             std::abs(values.defect[row]), family, "", "", i, knot});
      }
}

/// NaN before infinity before the largest number.
bool is_worse(const RowViolation& a, const RowViolation& b) {
  if (std::isnan(a.value) || std::isnan(b.value)) return std::isnan(a.value) > std::isnan(b.value);
  return a.value > b.value;
}

}  // namespace

Evaluation evaluate(const TranscriptionModel& model, const TranscriptionInputs& inputs,
                    const RowMatrix& trajectory) {
  const TrajectoryValues at(model, inputs, trajectory);
  return summarize(at.rows(), inputs.policies(), at.values());
}

std::map<std::string, double> violations(const TranscriptionModel& model,
                                         const TranscriptionInputs& inputs,
                                         const RowMatrix& trajectory) {
  const TrajectoryValues at(model, inputs, trajectory);
  std::map<std::string, double> worst;
  for (std::size_t k = 0; k < at.rows().size(); ++k) {
    const KnotRows& rows = *at.rows()[k];
    const auto& groups = model.problem().rows(rows.stage, RowKind::Inequality);
    for (const RowGroup& group : groups) worst.emplace(group.family, 0.0);
    for (const std::vector<int>* kind : {&rows.penalty_rows, &rows.inequality_rows})
      for (int row : *kind) {
        const RowGroup& group = group_of(groups, row);
        double& entry = worst.at(group.family);
        entry = max_or_nan(entry, group.scale * at.values()[k].inequality[size_of(row)]);
      }
  }
  return worst;
}

std::vector<RowViolation> worst_rows(const TranscriptionModel& model,
                                     const TranscriptionInputs& inputs, const RowMatrix& trajectory,
                                     int count) {
  const TrajectoryValues at(model, inputs, trajectory);
  std::vector<RowViolation> rows;
  for (std::size_t k = 0; k < at.rows().size(); ++k)
    add_residuals(model.problem(), *at.rows()[k], at.values()[k], static_cast<int>(k), rows);
  const auto kept = std::min(rows.size(), static_cast<std::size_t>(std::max(count, 0)));
  std::partial_sort(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(kept), rows.end(),
                    is_worse);
  rows.resize(kept);
  return rows;
}

std::string describe_worst_rows(const TranscriptionModel& model, const TranscriptionInputs& inputs,
                                const RowMatrix& trajectory) {
  std::ostringstream text;
  for (const RowViolation& row : worst_rows(model, inputs, trajectory, 3))
    text << (text.tellp() == 0 ? "worst: " : ", ") << row.name << ' ' << row.value;
  return text.str();
}

}  // namespace palanquin
