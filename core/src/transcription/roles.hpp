#pragma once

#include <map>
#include <set>
#include <tuple>
#include <vector>

#include "palanquin/core/transcription/inputs.hpp"
#include "palanquin/core/transcription/knot_shape.hpp"
#include "palanquin/core/transcription/model.hpp"
#include "transcription/flag_table.hpp"

namespace palanquin {

/// What the run-time flags of the parameters make of every knot: its signature. A moving gait
/// repeats its flags: what follows from them is worked out once and looked up.
class KnotRoles {
 public:
  explicit KnotRoles(const TranscriptionModel& model);

  /// Reads the flags of all knots; `resolve` has work to do where they have changed. Allocates only
  /// for new combinations. Throws std::invalid_argument for a role that does not exist.
  void read(const TranscriptionInputs& inputs, FunctionWorkspace& w);
  /// The policies have changed.
  void expire();
  bool is_stale() const { return is_stale_; }
  /// Makes signatures() those of the flags and policies. Throws std::logic_error before `read`.
  void resolve(const RowPolicies& policies);
  /// Of every knot; equal ones have one address.
  const std::vector<const KnotSignature*>& signatures() const { return signatures_; }

  /// Combinations that are kept.
  std::size_t size() const { return table_.size() + resolved_.size() + kept_.size(); }
  /// Forgets them all; `read` and `resolve` begin anew.
  void clear();

 private:
  Role stated_role(int knot, std::size_t block) const;
  Role resolve_role(int knot, std::size_t block) const;
  bool has_row(int knot, RowKind kind, std::size_t group) const;
  bool is_looked_back_at(int knot, std::size_t block) const;
  const KnotSignature* resolve_signature(int knot, const RowPolicies& policies);

  const TranscriptionModel& model_;
  FlagTable table_;
  std::vector<std::vector<char>> looks_back_;  // [link groups][blocks] at the knot before
  std::vector<const Flags*> flags_;
  std::set<KnotSignature> kept_;
  /// By the signature of the knot before, the knot's own flags and those of the next one.
  std::map<std::tuple<const KnotSignature*, const Flags*, const Flags*>, const KnotSignature*>
      resolved_;
  std::vector<const KnotSignature*> signatures_;
  bool is_stale_ = true;
};

/// Entries k - 1 and k + 1 of a list over the knots, null beyond its ends.
template <typename List>
auto before(const List& list, std::size_t k) {
  return k > 0 ? list[k - 1] : nullptr;
}
template <typename List>
auto after(const List& list, std::size_t k) {
  return k + 1 < list.size() ? list[k + 1] : nullptr;
}

}  // namespace palanquin
