// From the run-time flags of the parameters to roles, and from them to the shapes of the QP's
// stages. A moving gait repeats its flags: what follows from them is worked out once and looked up.

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "knot_buffers.hpp"
#include "palanquin/core/transcription.hpp"

namespace palanquin {

// ---- flags ------------------------------------------------------------------------------------

Transcription::FlagTable::FlagTable(const LoweredProblem& problem) : problem_(problem) {
  for (std::size_t i = 0; i + 1 < start_.size(); ++i)
    start_[i + 1] = start_[i] + size_of(problem.structure.result(static_cast<int>(i)).nnz());
  values_.resize(start_.back());
}

const Transcription::Flags* Transcription::FlagTable::read(int knot, const double* parameters,
                                                           const Flags* last,
                                                           FunctionWorkspace& w) {
  w.arguments[0] = parameters;
  for (std::size_t i = 0; i + 1 < start_.size(); ++i) w.results[i] = values_.data() + start_[i];
  problem_.structure(w);
  if (last != nullptr && compare(*last, values_) == 0) return last;
  if (const auto known = kept_.find(values_); known != kept_.end()) return &*known;
  check_roles(knot);
  return &*kept_.insert(values_).first;
}

int Transcription::FlagTable::compare(const Flags& a, const Flags& b) {
  return std::memcmp(a.data(), b.data(), a.size() * sizeof(double));
}

void Transcription::FlagTable::check_roles(int knot) const {
  const double* role = roles(values_);
  for (const BlockInfo& block : problem_.blocks()) {
    const double code = *role++;
    if (block.is_state || code == 0.0 || code == 1.0 || code == 2.0 || code == 3.0) continue;
    throw std::invalid_argument("role of '" + block.name + "' at knot " + std::to_string(knot) +
                                " is " + std::to_string(code) +
                                "; it must be 0 (input), 1 (carried), 2 (local) or 3 (absent)");
  }
}

void Transcription::read_flags() {
  for (int k = 0; k <= horizon_; ++k) {
    const Flags*& flags = flags_[size_of(k)];
    const Flags* now = flag_table_->read(k, parameters_at(k), flags, workspaces_.front());
    if (now != flags) shapes_stale_ = true;
    flags = now;
  }
}

// ---- roles ------------------------------------------------------------------------------------

/// The role that a problem's expressions ask for.
Role Transcription::stated_role(int knot, std::size_t b) const {
  if (problem_->blocks()[b].is_state) return Role::State;
  if (knot == horizon_) return Role::Absent;
  return static_cast<Role>(static_cast<int>(flag_table_->roles(*flags_[size_of(knot)])[b]));
}

/// The role of a block at a knot, those of the knot before being resolved.
Role Transcription::resolve_role(int knot, std::size_t b) const {
  const Role role = stated_role(knot, b);
  // What the next knot carries must meet the dynamics here: a local becomes an input.
  if (role == Role::Local && stated_role(knot + 1, b) == Role::Carried) return Role::Input;
  if (role != Role::Carried) return role;
  if (form_ == Form::Paper) return Role::Input;  // a row says what it is
  // A chain that starts before the horizon, or at a block held at zero, is known throughout.
  if (knot == 0) return Role::Fixed;
  const Role before = signatures_[size_of(knot - 1)]->role[b];
  return before == Role::Fixed || before == Role::Absent ? Role::Fixed : Role::Carried;
}

/// What the flags of a knot and of the next one make of it, those of the knot before being
/// resolved.
const KnotSignature* Transcription::resolve_signature(int knot) {
  const std::size_t blocks = problem_->blocks().size();
  const Flags& flags = *flags_[size_of(knot)];
  KnotSignature s;
  s.stage = knot == horizon_ ? StageKind::Terminal : StageKind::Running;
  s.role.resize(blocks);
  s.charted.resize(blocks);
  for (std::size_t b = 0; b < blocks; ++b) {
    s.role[b] = resolve_role(knot, b);
    // A carried block moves in the coordinates of the knot where its chain begins.
    const bool is_charted = s.role[b] == Role::Carried
                                ? signatures_[size_of(knot - 1)]->charted[b] != 0
                                : flag_table_->charted(flags)[b] != 0.0;
    const bool has_columns =
        s.role[b] == Role::Input || s.role[b] == Role::Local || s.role[b] == Role::Carried;
    s.charted[b] = is_charted && has_columns && form_ == Form::Reduced;
  }
  for (RowKind kind : {RowKind::Equality, RowKind::Inequality, RowKind::Link}) {
    const auto& groups = problem_->rows(s.stage, kind);
    auto& active = s.active[static_cast<std::size_t>(kind)];
    active.resize(groups.size());
    for (std::size_t g = 0; g < groups.size(); ++g)
      active[g] = flag_table_->active(flags, s.stage, kind)[g] != 0.0 &&
                  !(groups[g].implied && form_ == Form::Reduced);
  }
  s.is_hard = is_hard_[static_cast<int>(s.stage)];
  return table_.keep(s);
}

// ---- shapes -----------------------------------------------------------------------------------

void Transcription::resolve_shapes() {
  if (!shapes_stale_) return;
  if (flags_.front() == nullptr) throw std::logic_error("the parameters have not been set");
  const auto before = [](const auto& list, std::size_t k) { return k > 0 ? list[k - 1] : nullptr; };
  const auto after = [](const auto& list, std::size_t k) {
    return k + 1 < list.size() ? list[k + 1] : nullptr;
  };
  for (std::size_t k = 0; k < shapes_.size(); ++k) {
    const KnotSignature*& signature =
        resolved_[{before(signatures_, k), flags_[k], after(flags_, k)}];
    if (signature == nullptr) signature = resolve_signature(static_cast<int>(k));
    signatures_[k] = signature;
  }
  for (std::size_t k = 0; k < shapes_.size(); ++k)
    shapes_[k] = &table_.find(before(signatures_, k), signatures_[k], after(signatures_, k));
  update_stages();
  shapes_stale_ = false;
}

/// Gives every stage whose knot has another shape now the patterns of that.
void Transcription::update_stages() {
  for (int k = 0; k <= horizon_; ++k) {
    QpStage& stage = qp_.stages[size_of(k)];
    if (stage.pattern >= 0 && stage.pattern != shape(k).pattern.pattern)
      idle_[stage.pattern].push_back(std::move(stage));
  }
  for (int k = 0; k <= horizon_; ++k) {
    QpStage& stage = qp_.stages[size_of(k)];
    if (stage.pattern == shape(k).pattern.pattern) continue;
    take_on(stage, shape(k));
    ++qp_.structure_revision;
  }
  qp_.initial_state.resize(qp_.stages.front().nx);
}

/// The patterns are those of a stage that had the shape before, so that a moving gait does not
/// allocate, or a copy.
void Transcription::take_on(QpStage& stage, const KnotShape& shape) {
  std::vector<QpStage>& idle = idle_[shape.pattern.pattern];
  if (idle.empty()) {
    stage = shape.pattern;
  } else {
    stage = std::move(idle.back());
    idle.pop_back();
  }
  const std::vector<Policy>& policies = policies_[static_cast<int>(shape.signature.stage)];
  for (std::size_t i = 0; i < shape.penalty_rows.size(); ++i)
    stage.penalty_policy[i] = policies[size_of(shape.penalty_rows[i])];
}

}  // namespace palanquin
