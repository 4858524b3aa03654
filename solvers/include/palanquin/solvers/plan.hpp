#pragma once

#include <map>
#include <string>
#include <vector>

#include "palanquin/core/diagnosis/snapshot.hpp"
#include "palanquin/core/transcription/workspace.hpp"
#include "palanquin/solvers/iteration_record.hpp"
#include "palanquin/solvers/status.hpp"

namespace palanquin {

/// Outcome of a solve: a value, which says the same whatever its solver does afterwards, from any
/// thread.
struct Plan : Snapshot {
  using Snapshot::Snapshot;

  Status status = Status::NotSolved;
  std::string message;            ///< which test stopped the solve, in words
  Evaluation evaluation;          ///< of the trajectory; NaN where the status is NonFinite
  double usable_violation = 0.0;  ///< the solver's setting
  /// Where the status is Infeasible, what proves it: weights y of the rows, of norm 1, with which
  /// the rows' derivatives cancel each other along the dynamics while y'(rows) > 0.
  RowMultipliers certificate;
  NonFinite non_finite;                  ///< where the status is NonFinite: what was not
  std::vector<IterationRecord> history;  ///< of an SQP solve
  int iterations = 0;
  PhaseTimes times;
  double feedback_ms = Evaluation::kNaN;  ///< of a feedback phase

  /// Whether the plan may be executed: its status is usable, and no equality or hard row is
  /// violated by more than `usable_violation`.
  bool is_usable() const { return palanquin::is_usable(status, evaluation, usable_violation); }
  /// As Snapshot's; all NaN where the status is NonFinite.
  std::map<std::string, double> violations() const;  // NOLINT(bugprone-derived-*)
  /// The rows with their weights in `certificate` for multipliers; empty without one.
  std::vector<RowState> certificate_rows() const;
};

}  // namespace palanquin
