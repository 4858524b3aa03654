#pragma once

#include <string_view>
#include <vector>

#include "palanquin/core/transcription/evaluation.hpp"
#include "palanquin/solvers/qp_solver.hpp"

namespace palanquin {

/// How the step of one iteration was found; the rungs of the ladder, from good to bad.
enum class StepKind {
  Full,
  Damped,       ///< shortened by the filter, or in a real-time step because it blew up
  Regularized,  ///< of a QP with Levenberg-Marquardt damping
  Restored,     ///< towards the rows instead of the optimum, since the QP had no solution
  Rejected,     ///< none acceptable: the iterate was kept
};
std::string_view to_string(StepKind kind);

/// Milliseconds that one iteration (or a whole solve) spent per phase.
struct PhaseTimes {
  double transcribe = 0.0;  ///< parameters, measured state and guess taken over, roles settled
  double linearize = 0.0;
  double update = 0.0;     ///< QP back end: values and factorisation
  double solve = 0.0;      ///< QP back end: the rest, and the penalty subproblem's own work
  double globalize = 0.0;  ///< evaluations and line search
  double total() const { return transcribe + linearize + update + solve + globalize; }
};

/// What one iteration did; printing, histories and plots all read this record.
struct IterationRecord {
  double cost = Evaluation::kNaN;            ///< after the step, without penalties
  double penalty = Evaluation::kNaN;         ///< after the step
  double equality_max = Evaluation::kNaN;    ///< after the step
  double inequality_max = Evaluation::kNaN;  ///< after the step
  double predicted = Evaluation::kNaN;       ///< change of cost and penalty that the QP predicted
  double step_length = 0.0;                  ///< in (0, 1]; 0 when the iterate was kept
  StepKind step = StepKind::Rejected;
  double damping = 0.0;        ///< Levenberg-Marquardt weight of the QP, see Damping
  bool is_exact = false;       ///< the QP had exact Hessians
  bool convexified = false;    ///< whose negative eigenvalues were mirrored
  bool refused_cycle = false;  ///< the full step led back to where the iteration was before
  int inner_iterations = 0;    ///< QP solves of the penalty subproblem
  bool fell_back = false;      ///< the QP back end's fast method failed, another one answered
  /// Of the Lagrangian's gradient before the step, relative; NaN where it was not looked at.
  double stationarity = Evaluation::kNaN;
  QpStatus qp_status = QpStatus::NotSolved;
  PhaseTimes times;
};

/// What all iterations of a solve took.
PhaseTimes sum_of(const std::vector<IterationRecord>& history);

}  // namespace palanquin
