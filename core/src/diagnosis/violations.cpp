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

/// A row before it has a name.
struct Row {
  int knot = 0;
  RowKind kind{};
  const RowGroup* group = nullptr;   ///< null for dynamics,
  const BlockInfo* state = nullptr;  ///< which have a block instead
  int row = 0;                       ///< of the group or block
  double value = 0.0;
  double multiplier = Evaluation::kNaN;

  bool is_inequality() const { return group != nullptr && kind == RowKind::Inequality; }
  double violation() const { return is_inequality() ? value : std::abs(value); }
};

/// Entry `i` of the multipliers of a knot; NaN where they are not known.
double entry(const std::vector<Eigen::VectorXd>& of_knots, int knot, std::size_t i) {
  const auto k = static_cast<std::size_t>(knot);
  const auto index = static_cast<Eigen::Index>(i);
  return k < of_knots.size() && index < of_knots[k].size() ? of_knots[k][index] : Evaluation::kNaN;
}

/// The rows of one knot, in the order of KnotRows, then its dynamics.
void add_rows(const LoweredProblem& problem, const KnotRows& rows, const KnotValues& values,
              const RowPolicies& policies, const RowMultipliers& multipliers, int knot,
              std::vector<Row>& found) {
  const auto add = [&](const std::vector<int>& indices, const std::vector<double>& of_rows,
                       RowKind kind, auto multiplier) {
    for (std::size_t i = 0; i < indices.size(); ++i) {
      const int row = indices[i];
      const RowGroup& group = group_of(problem.rows(rows.stage, kind), row);
      found.push_back(
          {knot, kind, &group, nullptr, row - group.offset, of_rows[size_of(row)], multiplier(i)});
    }
  };
  add(rows.penalty_rows, values.inequality, RowKind::Inequality, [&](std::size_t i) {
    const auto row = size_of(rows.penalty_rows[i]);
    return multipliers.penalty.empty()
               ? evaluate_penalty(policies.at(rows.stage).policy[row], values.inequality[row]).slope
               : entry(multipliers.penalty, knot, i);
  });
  add(rows.inequality_rows, values.inequality, RowKind::Inequality,
      [&](std::size_t i) { return entry(multipliers.inequality, knot, i); });
  add(rows.measured_rows, values.inequality, RowKind::Inequality, [](std::size_t) { return 0.0; });
  add(rows.equality_rows, values.equality, RowKind::Equality,
      [&](std::size_t i) { return entry(multipliers.equality, knot, i); });
  // A solver has link rows as such, or as equality rows of the later knot.
  const std::size_t own = rows.equality_rows.size();
  const auto of_link = [&](std::size_t i) {
    const double as_such = entry(multipliers.link, knot, i);
    return std::isnan(as_such) ? entry(multipliers.equality, knot, own + i) : as_such;
  };
  add(rows.link_rows, values.link, RowKind::Link, of_link);
  add(rows.own_links, values.link, RowKind::Link, of_link);
  if (rows.stage == StageKind::Terminal) return;
  std::size_t row = 0;
  for (const BlockInfo& b : problem.states())
    for (int i = 0; i < b.tangent_size; ++i, ++row)
      found.push_back(
          {knot, {}, nullptr, &b, i, values.defect[row], entry(multipliers.dynamics, knot, row)});
}

std::vector<Row> all_rows(const TranscriptionModel& model, const TranscriptionInputs& inputs,
                          const RowMatrix& trajectory, const RowMultipliers& multipliers) {
  const TrajectoryValues at(model, inputs, trajectory);
  std::vector<Row> rows;
  for (std::size_t k = 0; k < at.rows().size(); ++k)
    add_rows(model.problem(), *at.rows()[k], at.values()[k], inputs.policies(), multipliers,
             static_cast<int>(k), rows);
  return rows;
}

std::string name_of(const Row& r) {
  const std::string knot = "knot " + std::to_string(r.knot) + ")";
  if (r.group == nullptr)
    return "dynamics of " + r.state->name + "[" + std::to_string(r.row) + "] (" + knot;
  std::string text = r.group->family + " (";
  if (!r.group->robot.empty()) text += "robot " + r.group->robot + ", ";
  if (!r.group->limb.empty()) text += "limb " + r.group->limb + ", ";
  return text + "row " + std::to_string(r.row) + ", " + knot;
}

RowState named(const Row& r) {
  constexpr const char* kKinds[] = {"equality", "inequality", "link"};
  RowState state;
  state.name = name_of(r);
  state.value = r.value;
  state.row = r.row;
  state.knot = r.knot;
  state.multiplier = r.multiplier;
  if (r.group == nullptr) {
    state.kind = "dynamics";
    state.family = "dynamics of " + r.state->name;
    return state;
  }
  state.kind = kKinds[static_cast<int>(r.kind)];
  state.family = r.group->family;
  state.robot = r.group->robot;
  state.limb = r.group->limb;
  state.scale = r.group->scale;
  return state;
}

/// NaN before infinity before the largest number.
bool is_worse(const Row& a, const Row& b) {
  if (std::isnan(a.value) || std::isnan(b.value)) return std::isnan(a.value) > std::isnan(b.value);
  return a.violation() > b.violation();
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
    for (const std::vector<int>* kind :
         {&rows.penalty_rows, &rows.inequality_rows, &rows.measured_rows})
      for (int row : *kind) {
        const RowGroup& group = group_of(groups, row);
        double& entry = worst.at(group.family);
        entry = max_or_nan(entry, group.scale * at.values()[k].inequality[size_of(row)]);
      }
  }
  return worst;
}

std::vector<RowState> row_states(const TranscriptionModel& model, const TranscriptionInputs& inputs,
                                 const RowMatrix& trajectory, const RowMultipliers& multipliers) {
  std::vector<RowState> states;
  for (const Row& row : all_rows(model, inputs, trajectory, multipliers))
    states.push_back(named(row));
  return states;
}

std::vector<RowState> worst_rows(const TranscriptionModel& model, const TranscriptionInputs& inputs,
                                 const RowMatrix& trajectory, int count,
                                 const RowMultipliers& multipliers) {
  std::vector<Row> rows = all_rows(model, inputs, trajectory, multipliers);
  std::erase_if(rows, [](const Row& row) { return row.violation() <= kRoundingLevel; });
  const auto kept = std::min(rows.size(), static_cast<std::size_t>(std::max(count, 0)));
  std::partial_sort(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(kept), rows.end(),
                    is_worse);
  rows.resize(kept);
  std::vector<RowState> states;
  for (const Row& row : rows) {
    states.push_back(named(row));
    states.back().value = row.violation();
  }
  return states;
}

std::string describe_worst_rows(const TranscriptionModel& model, const TranscriptionInputs& inputs,
                                const RowMatrix& trajectory, double tolerance) {
  std::ostringstream text;
  for (const RowState& row : worst_rows(model, inputs, trajectory, 3)) {
    if (row.value <= tolerance) break;
    text << (text.tellp() == 0 ? "worst: " : ", ") << row.name << ' ' << row.value;
  }
  if (text.tellp() == 0) text << "no row is violated by more than " << tolerance;
  return text.str();
}

}  // namespace palanquin
