#pragma once

#include <array>
#include <set>
#include <vector>

#include "palanquin/core/lowered_problem.hpp"

namespace palanquin {

/// Results of the lowered function `structure` at one knot.
using Flags = std::vector<double>;

/// Roles, chart flags and active flags of knots, as the lowered function `structure` gives them.
/// Each combination is kept once, so that equal ones have one address.
class FlagTable {
 public:
  explicit FlagTable(const LoweredProblem& problem);
  /// The flags for a knot's `parameters`; `last`, which is tried first, may be null. Allocates only
  /// when the combination is new. Throws std::invalid_argument for a role that does not exist.
  const Flags* read(int knot, const double* parameters, const Flags* last, FunctionWorkspace& w);

  const double* roles(const Flags& f) const { return f.data(); }                // [blocks]
  const double* charted(const Flags& f) const { return f.data() + start_[1]; }  // [blocks]
  const double* active(const Flags& f, StageKind stage, RowKind kind) const {   // [groups]
    return f.data() +
           start_[2 + static_cast<std::size_t>(stage) * 3 + static_cast<std::size_t>(kind)];
  }

  std::size_t size() const { return kept_.size(); }
  /// Forgets all combinations; addresses that were given out are void.
  void clear() { kept_.clear(); }

 private:
  void check_roles(int knot) const;
  static int compare(const Flags& a, const Flags& b);
  struct Order {
    bool operator()(const Flags& a, const Flags& b) const { return compare(a, b) < 0; }
  };

  const LoweredProblem& problem_;
  std::array<std::size_t, 8> start_{};  // of the results in the flags; the last one: their end
  std::set<Flags, Order> kept_;
  Flags values_;  // those read last
};

}  // namespace palanquin
