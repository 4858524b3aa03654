#include "transcription/roles.hpp"

#include <algorithm>
#include <stdexcept>

#include "transcription/sizes.hpp"

namespace palanquin {

KnotRoles::KnotRoles(const TranscriptionModel& model)
    : model_(model),
      table_(model.problem()),
      flags_(size_of(model.horizon() + 1)),
      signatures_(flags_.size()) {
  const LoweredProblem& problem = model.problem();
  const Sparsity& pattern = problem.link_linear.result(1);
  for (const RowGroup& group : problem.rows(StageKind::Running, RowKind::Link)) {
    std::vector<char>& seen = looks_back_.emplace_back(problem.blocks().size());
    for (std::size_t b = 0; b < seen.size(); ++b) {
      const BlockInfo& block = problem.blocks()[b];
      const int* row = pattern.row_index.data();
      seen[b] = std::any_of(
          row + pattern.column_start[size_of(block.tangent_offset)],
          row + pattern.column_start[size_of(block.tangent_offset + block.tangent_size)],
          [&](int r) { return r >= group.offset && r < group.offset + group.size; });
    }
  }
}

void KnotRoles::read(const TranscriptionInputs& inputs, FunctionWorkspace& w) {
  for (int k = 0; k <= model_.horizon(); ++k) {
    const Flags*& flags = flags_[size_of(k)];
    const Flags* now = table_.read(k, inputs.parameters().row(k).data(), flags, w);
    if (now != flags) is_stale_ = true;
    flags = now;
  }
}

void KnotRoles::expire() {
  resolved_.clear();
  is_stale_ = true;
}

void KnotRoles::resolve(const RowPolicies& policies) {
  // All of them are null until the last knot's flags have been read once.
  if (flags_.back() == nullptr) throw std::logic_error("the parameters have not been set");
  for (std::size_t k = 0; k < flags_.size(); ++k) {
    const KnotSignature*& signature =
        resolved_[{before(signatures_, k), flags_[k], after(flags_, k)}];
    if (signature == nullptr) signature = resolve_signature(static_cast<int>(k), policies);
    signatures_[k] = signature;
  }
  is_stale_ = false;
}

void KnotRoles::clear() {
  table_.clear();
  resolved_.clear();
  kept_.clear();
  std::fill(flags_.begin(), flags_.end(), nullptr);
  std::fill(signatures_.begin(), signatures_.end(), nullptr);
  is_stale_ = true;
}

// ---- roles ------------------------------------------------------------------------------------

/// The role that a problem's expressions ask for. A block with dynamics is a State at every knot,
/// or an Input at the first where its expression says so: then its value there is decided with the
/// trajectory, not measured.
Role KnotRoles::stated_role(int knot, std::size_t b) const {
  const auto stated = static_cast<Role>(static_cast<int>(table_.roles(*flags_[size_of(knot)])[b]));
  if (model_.problem().blocks()[b].is_state)
    return knot == 0 && stated == Role::Input ? Role::Input : Role::State;
  return knot == model_.horizon() ? Role::Absent : stated;
}

/// The role of a block at a knot, those of the knot before being resolved.
Role KnotRoles::resolve_role(int knot, std::size_t b) const {
  const Role role = stated_role(knot, b);
  // What the next knot carries or looks back at meets more than this knot: a local is an input.
  if (role == Role::Local &&
      (stated_role(knot + 1, b) == Role::Carried || is_looked_back_at(knot, b)))
    return Role::Input;
  if (role != Role::Carried) return role;
  if (model_.form() == Form::Paper) return Role::Input;  // a row says what it is
  // A chain that starts before the horizon, or at a block held at zero, is known throughout.
  if (knot == 0) return Role::Fixed;
  const Role before = signatures_[size_of(knot - 1)]->role[b];
  return before == Role::Fixed || before == Role::Absent ? Role::Fixed : Role::Carried;
}

/// Whether the form states the rows of a group at a knot.
bool KnotRoles::has_row(int knot, RowKind kind, std::size_t group) const {
  const StageKind stage = knot == model_.horizon() ? StageKind::Terminal : StageKind::Running;
  return table_.active(*flags_[size_of(knot)], stage, kind)[group] != 0.0 &&
         !(model_.problem().rows(stage, kind)[group].implied && model_.form() == Form::Reduced);
}

/// Whether a row of the next knot holds the block's value here.
bool KnotRoles::is_looked_back_at(int knot, std::size_t b) const {
  for (std::size_t g = 0; knot + 1 < model_.horizon() && g < looks_back_.size(); ++g)
    if (looks_back_[g][b] != 0 && has_row(knot + 1, RowKind::Link, g)) return true;
  return false;
}

/// What the flags of a knot and of the next one make of it, those of the knot before being
/// resolved.
const KnotSignature* KnotRoles::resolve_signature(int knot, const RowPolicies& policies) {
  const std::size_t blocks = model_.problem().blocks().size();
  const Flags& flags = *flags_[size_of(knot)];
  KnotSignature s;
  s.stage = knot == model_.horizon() ? StageKind::Terminal : StageKind::Running;
  s.role.resize(blocks);
  s.charted.resize(blocks);
  for (std::size_t b = 0; b < blocks; ++b) {
    s.role[b] = resolve_role(knot, b);
    // A carried block moves in the coordinates of the knot where its chain begins.
    const bool is_charted = s.role[b] == Role::Carried
                                ? signatures_[size_of(knot - 1)]->charted[b] != 0
                                : table_.charted(flags)[b] != 0.0;
    const bool has_columns =
        s.role[b] == Role::Input || s.role[b] == Role::Local || s.role[b] == Role::Carried;
    s.charted[b] = is_charted && has_columns && model_.form() == Form::Reduced;
  }
  for (RowKind kind : {RowKind::Equality, RowKind::Inequality, RowKind::Link}) {
    const auto& groups = model_.problem().rows(s.stage, kind);
    auto& active = s.active[static_cast<std::size_t>(kind)];
    active.resize(groups.size());
    for (std::size_t g = 0; g < groups.size(); ++g) active[g] = has_row(knot, kind, g);
  }
  s.is_hard = policies.at(s.stage).is_hard;
  const std::vector<char>& rows = s.active[static_cast<std::size_t>(RowKind::Inequality)];
  for (std::size_t g = 0; g < rows.size(); ++g)
    s.is_measured = s.is_measured || (knot == 0 && rows[g] != 0 && s.is_hard[g] != 0);
  return &*kept_.insert(s).first;
}

}  // namespace palanquin
