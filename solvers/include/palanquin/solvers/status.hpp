#pragma once

#include <string_view>

#include "palanquin/core/transcription/evaluation.hpp"

namespace palanquin {

/// Why a solve stopped.
enum class Status {
  NotSolved,
  Converged,       ///< steps, cost and residuals are within their tolerances
  IterationLimit,  ///< as many iterations as asked for, all of them fine: the normal end of a
                   ///< real-time iteration
  Stalled,         ///< no acceptable step from a feasible point
  Diverged,        ///< a real-time step blew up, however short it was: the guess was kept
  Infeasible,      ///< rows contradict each other, or residuals that no step reduces
  QpFailed,        ///< the QP back end found no usable point
  NonFinite,       ///< a function gave NaN or infinity at the start
};

std::string_view to_string(Status status);

/// Whether the solve ended in a way that may leave a plan to execute; whether it did, its residuals
/// say.
inline bool is_usable(Status s) {
  return s == Status::Converged || s == Status::IterationLimit || s == Status::Stalled;
}

/// Whether the iterate may be executed as a plan: the solve ended well, everything is finite, and
/// no equality or hard row is violated by more than `tolerance`, in its own unit.
inline bool is_usable(Status s, const Evaluation& evaluation, double tolerance) {
  return is_usable(s) && evaluation.is_finite && evaluation.equality_max <= tolerance &&
         evaluation.inequality_max <= tolerance;
}

}  // namespace palanquin
