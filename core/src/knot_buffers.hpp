#pragma once

#include <algorithm>
#include <array>
#include <set>
#include <vector>

#include "palanquin/core/lowered_problem.hpp"
#include "palanquin/core/transcription.hpp"

namespace palanquin {

/// An int as a standard container counts.
inline std::size_t size_of(int count) { return static_cast<std::size_t>(count); }

/// Rows of a kind at a running knot or at the terminal one, whichever has more.
inline std::size_t most_rows(const LoweredProblem& problem, RowKind kind) {
  return static_cast<std::size_t>(std::max(problem.row_count(StageKind::Running, kind),
                                           problem.row_count(StageKind::Terminal, kind)));
}

/// Values of the lowered functions at one knot.
struct Transcription::KnotBuffers {
  explicit KnotBuffers(const LoweredProblem& problem);

  std::vector<double> next_state;  // d, ambient, states only
  std::vector<double> defect;      // d (-) x+ in the tangent space
  double cost = 0.0;
  std::vector<double> equality, inequality, link;
  std::vector<double> slopes;  // of the charts
  int local_entry = -1;        // of the dynamics' Jacobian, where a local meets it; negative: none
};

/// Results of the lowered functions of a running knot, with derivatives, in order.
enum class Transcription::KnotResult : int {
  NextState,
  Cost,
  Equality,
  Inequality,
  Dynamics,
  Implicit,
  Gradient,
  Hessian,
  EqualityJacobian,
  InequalityJacobian
};

/// Results that a thread needs for one knot at a time.
struct Transcription::ThreadBuffers {
  explicit ThreadBuffers(const LoweredProblem& problem);

  std::vector<double> link_previous, link;  // Jacobians of the link rows
  std::vector<double> embedded;             // of the charts
  std::vector<double> unused_slopes;        // where only the charts' values are wanted
};

/// Arguments and results of the exact Hessian of one knot.
struct Transcription::ExactBuffers {
  ExactBuffers(const LoweredProblem& problem, const ExactHessian& exact);

  std::vector<double> hessian;
  std::vector<double> charted;                         // flag per block
  std::vector<double> dynamics, equality, inequality;  // multipliers of the lowered rows
  CurvatureMirror mirror;
};

/// Roles, chart flags and active flags of knots, as the lowered function `structure` gives them.
/// Each combination is kept once, so that equal ones have one address.
class Transcription::FlagTable {
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
