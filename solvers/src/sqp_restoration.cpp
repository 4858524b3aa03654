// What an Sqp does where rows cannot be met to first order (docs/algorithms.md, section 4).

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "merit_of.hpp"
#include "palanquin/solvers/sqp.hpp"

namespace palanquin {

/// Step 4: towards the rows, when they are to blame. A real-time step keeps the cost in sight.
bool Sqp::restore(IterationRecord& record) {
  const bool rows_failed =
      !is_feasible(evaluation_) || (is_real_time_ && !is_usable(record.qp_status));
  const bool may = !is_real_time_ || settings_.restoration.elastic;
  if (status_ != Status::NotSolved || !rows_failed || !may || deadline_.has_passed()) return false;
  if (added_damping_ == 0.0) damping_.measure(transcription_->qp());
  constexpr double kEnough = 0.9;  // of the residuals, before the QP is tried again
  filter_.add(merit_of(evaluation_));
  if (std::isinf(restored_below_)) restored_below_ = kEnough * evaluation_.infeasibility;
  const StageQp& qp = transcription_->qp();
  bool found = false;
  do {
    if (!is_usable(restoration_.solve(qp, damping_.scale(), is_real_time_, solution_))) continue;
    if (!is_real_time_ && dynamics_hold() && restoration_.is_stationary())
      return end_stationary(record);
    found = search_restoration(record);
  } while (!found && !deadline_.has_passed() && restoration_.shorten());
  if (!found) restoration_.reset();
  if (is_real_time_ || !dynamics_hold()) return found;
  const bool has_gained =
      found && !restoration_.is_negligible(before_.infeasibility, evaluation_.infeasibility);
  if (has_gained || !restoration_.is_stationary_when_balanced(qp, damping_.scale())) return found;
  return end_stationary(record);
}

/// Whether the violation, stationary here, falls to second order: at the centre of a circle that is
/// to be reached all directions are alike to first order. Takes the first of some random steps, of
/// growing length along the dynamics, by which it does.
bool Sqp::leave_stationary(IterationRecord& record) {
  constexpr int kEscapes = 4, kDirections = 4;
  constexpr double kLengths[] = {1e-2, -1e-2, 1e-1, -1e-1, 1.0, -1.0};  // of the trajectory's size
  if (escapes_ == kEscapes) return false;
  ++escapes_;
  const double size = std::max(1.0, iterate_.cwiseAbs().maxCoeff());
  for (int direction = 0; direction < kDirections; ++direction) {
    if (!restoration_.random_step(transcription_->qp(), damping_.scale(), solution_)) return false;
    for (const double length : kLengths) {
      if (deadline_.has_passed()) return false;
      try_length(length * size);
      if (!trial_evaluation_.is_finite ||
          restoration_.is_negligible(evaluation_.infeasibility, trial_evaluation_.infeasibility))
        continue;
      accept(1.0, StepKind::Restored, record);
      return true;
    }
  }
  return false;
}

/// Where the violation is stationary: leaves, or ends as infeasible.
bool Sqp::end_stationary(IterationRecord& record) {
  StageQpSolution certificate = restoration_.certificate(transcription_->qp());
  if (leave_stationary(record)) return true;
  certificate_ = std::move(certificate);
  finish(Status::Infeasible,
         "the rows cannot be met: no step brings them closer; " + describe_worst_rows(iterate_));
  return true;
}

/// Whether the rows, not the dynamics, make up what is violated where the QP was made.
bool Sqp::dynamics_hold() const {
  constexpr double kShare = 1e-6;  // of the dynamics in the squared residuals
  const double all = start_infeasibility_, rows = restoration_.violation();
  return rows > settings_.equality_tolerance && all * all - rows * rows <= kShare * all * all;
}

/// Backtracks until the residuals fall, a little only: a larger proximal term gives better short
/// steps.
bool Sqp::search_restoration(IterationRecord& record) {
  constexpr double kShortest = 0.1;
  const Merit current = merit_of(evaluation_);
  for (double alpha = 1.0; alpha >= kShortest; alpha *= settings_.line_search.contraction) {
    try_length(alpha);
    const Merit trial = merit_of(trial_evaluation_);
    const double enough =
        (1.0 - settings_.line_search.infeasibility_decrease * alpha) * current.infeasibility;
    const bool accepted = is_real_time_
                              ? !has_diverged(settings_.line_search, current, trial, start_cost_)
                              : trial_evaluation_.is_finite && trial.infeasibility < enough;
    if (!accepted) continue;
    accept(alpha, StepKind::Restored, record);
    if (alpha == 1.0)
      restoration_.lengthen();
    else
      restoration_.shorten();
    return true;
  }
  return false;
}

}  // namespace palanquin
