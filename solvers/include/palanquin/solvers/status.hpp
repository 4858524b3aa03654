#pragma once

#include <string_view>

#include "palanquin/core/transcription/evaluation.hpp"

namespace palanquin {

/// Why a solve stopped.
enum class Status {
  NotSolved,
  Converged,       ///< a point that satisfies the conditions of a minimum within the tolerances
  IterationLimit,  ///< as many iterations as asked for, all of them fine: the normal end of a
                   ///< real-time iteration
  TimeLimit,       ///< `max_seconds` have passed: the best iterate so far
  Stalled,         ///< no acceptable step from a feasible point
  Saddle,          ///< stationary and feasible, but no minimum: the curvature is negative
  Unfinished,      ///< residuals are too large to execute, without proof that they must be
  Diverged,        ///< a real-time step blew up, however short it was: the guess was kept
  Unbounded,       ///< the cost falls without end
  Infeasible,      ///< the rows' violation is stationary: no step brings them closer
  QpFailed,        ///< the QP back end found no usable point
  NonFinite,       ///< a function gave NaN or infinity
};

std::string_view to_string(Status status);

/// Whether the solve ended in a way that may leave a plan to execute; whether it did, its residuals
/// say.
inline bool is_usable(Status s) {
  return s == Status::Converged || s == Status::IterationLimit || s == Status::TimeLimit ||
         s == Status::Stalled || s == Status::Saddle;
}

/// Whether the iterate may be executed as a plan: the solve ended well, everything is finite, and
/// no equality or hard row is violated by more than `tolerance`, in its own unit.
inline bool is_usable(Status s, const Evaluation& evaluation, double tolerance) {
  return is_usable(s) && evaluation.is_finite && evaluation.equality_max <= tolerance &&
         evaluation.inequality_max <= tolerance;
}

}  // namespace palanquin
