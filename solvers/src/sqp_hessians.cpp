// Which Hessians the QPs of an Sqp have, and how they are damped (docs/algorithms.md, section 3).

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "palanquin/solvers/qp_factory.hpp"
#include "palanquin/solvers/sqp.hpp"
#include "stopwatch.hpp"

namespace palanquin {
namespace {

void forget_multipliers(StageQpSolution& solution) {
  for (auto* list : {&solution.dynamics_multiplier, &solution.equality_multiplier,
                     &solution.inequality_multiplier, &solution.link_multiplier})
    for (Eigen::VectorXd& part : *list) part.setZero();
}

}  // namespace

/// Makes room for exact Hessians. False where there are no functions for them.
bool Sqp::prepare_exact() {
  if (!has_asked_for_exact_ && exact_source_ != nullptr) {
    has_asked_for_exact_ = true;
    const TranscriptionModel& model = gauss_newton_.model();
    if (auto functions = exact_source_(); functions != nullptr)
      exact_ = std::make_unique<TranscriptionWorkspace>(
          std::make_shared<const TranscriptionModel>(model.shared_problem(), model.horizon(),
                                                     model.form(), std::move(functions),
                                                     model.links()),
          settings_.threads);
  }
  return exact_ != nullptr;
}

bool Sqp::is_exact() const { return transcription_ == exact_.get(); }

/// Takes the rest of the solve over to exact Hessians, if it chooses them itself and has none yet.
bool Sqp::adopt_exact() {
  if (settings_.hessian != HessianKind::Automatic || is_exact() || is_real_time_ ||
      !qp_solver_->capabilities().tells_inertia || !prepare_exact())
    return false;
  const TranscriptionInputs& inputs = gauss_newton_.inputs();
  exact_->set_policies(inputs.shared_policies());
  exact_->set_parameters(inputs.parameters());
  exact_->set_measured(inputs.measured());
  transcription_ = exact_.get();
  return true;
}

/// Step 1. False when a function is not finite.
bool Sqp::linearize(IterationRecord& record) {
  if (history_.empty()) record.times.transcribe = transcribe_ms_;
  Stopwatch watch;
  if (static_cast<int>(history_.size()) >= settings_.exact_after) adopt_exact();
  const NonFinite bad = transcription_->linearize(iterate_);
  record.times.linearize = watch.lap_ms();
  if (bad.found) {
    finish_non_finite(bad);
    return false;
  }
  added_damping_ = 0.0;
  if (is_exact() && static_cast<int>(history_.size()) >= exact_from_) use_exact_hessians(record);
  add_damping();
  evaluation_ = transcription_->summarize();
  start_cost_ = evaluation_.total();
  start_infeasibility_ = evaluation_.infeasibility;
  record.times.globalize = watch.lap_ms();
  return true;
}

/// Of the Lagrangian with the last QP's multipliers. Mirrored where the back end cannot tell
/// whether they are positive definite along the rows.
void Sqp::use_exact_hessians(IterationRecord& record) {
  Stopwatch watch;
  change_kind(true);
  solution_.resize(transcription_->qp());
  if (!has_multipliers_ && settings_.hessian == HessianKind::Automatic)
    forget_multipliers(solution_);
  damping_.forget_inertia();
  record.is_exact = true;
  record.convexified = !qp_solver_->capabilities().tells_inertia;
  transcription_->use_exact_hessians(iterate_, solution_, record.convexified);
  added_damping_ = 0.0;
  record.times.linearize += watch.lap_ms();
}

void Sqp::use_gauss_newton_hessians(IterationRecord& record) {
  Stopwatch watch;
  change_kind(false);
  transcription_->linearize(iterate_);
  record.is_exact = record.convexified = false;
  added_damping_ = 0.0;
  record.times.linearize += watch.lap_ms();
}

/// Either kind has a damping of its own, but where Gauss-Newton Hessians are singular.
void Sqp::change_kind(bool exact) {
  if (uses_exact_ != exact && !is_flat_) damping_.exchange(idle_damping_);
  uses_exact_ = exact;
}

/// For longer every time.
void Sqp::pause_exact() {
  exact_from_ = static_cast<int>(history_.size()) + 1 + exact_pause_;
  exact_pause_ = 2 * exact_pause_ + 2;
  idle_damping_ = 0.0;
}

/// Brings the Hessians' damping to what is in force.
void Sqp::add_damping() {
  if (damping_.weight() == added_damping_) return;
  if (added_damping_ == 0.0) damping_.measure(transcription_->qp());
  transcription_->regularize(damping_.weight() - added_damping_, damping_.scale());
  added_damping_ = damping_.weight();
}

/// For a step that failed: Gauss-Newton Hessians become exact; exact ones are damped until their QP
/// has a solution, or become Gauss-Newton's again when that takes much; all are damped while steps
/// are refused. False at the limit, or when the rows are to blame: never at a feasible point, where
/// no step is a solution.
bool Sqp::change_hessians(IterationRecord& record) {
  constexpr double kMuch = 0.05, kMuchWhereFlat = 1.0;  // damping of exact Hessians
  if (status_ != Status::NotSolved) return false;
  const bool is_solved = is_usable(record.qp_status);
  const bool is_contradiction = record.qp_status == QpStatus::PrimalInfeasible;
  if (is_contradiction && (is_real_time_ || !is_feasible(evaluation_))) return false;
  const bool is_singular = record.qp_status == QpStatus::FactorizationFailed;
  is_flat_ = is_flat_ || (is_singular && !is_exact());
  if (adopt_exact()) {
    transcription_->linearize(iterate_);
    use_exact_hessians(record);
  } else if (!is_solved && record.is_exact &&
             damping_.weight() >= (is_flat_ ? kMuchWhereFlat : kMuch)) {
    use_gauss_newton_hessians(record);
    if (!is_flat_) pause_exact();
  } else if (!is_solved && (record.is_exact || is_singular)) {
    if (!damping_.grow_to_factorize()) return false;
  } else {
    const bool is_lost = !is_solved && !is_feasible(evaluation_);
    if (is_lost || !damping_.grow()) return false;
  }
  add_damping();
  return true;
}

void Sqp::update_damping(const IterationRecord& record) {
  if (!settings_.globalize || record.step == StepKind::Restored) return;
  const double ratio = decrease_ratio(record);
  damping_.update(ratio, record.step_length == 1.0);
  // Exact Hessians tell when they need it; what lingers would slow the tail.
  const bool is_known_flat = is_flat_ && settings_.hessian == HessianKind::Automatic;
  if (record.is_exact && !is_known_flat && ratio > 0.9) damping_.update(ratio, true);
}

/// Actual to predicted decrease of cost + weight theta, with the least weight under which the step
/// is one of descent; NaN where rounding would decide.
double Sqp::decrease_ratio(const IterationRecord& record) const {
  const double weight =
      record.predicted > 0.0 && before_.infeasibility > 0.0
          ? std::max(2.0 * record.predicted / before_.infeasibility, multiplier_norm(solution_))
          : 0.0;
  const double predicted = weight * before_.infeasibility - record.predicted;
  const double actual = before_.total() - evaluation_.total() +
                        weight * (before_.infeasibility - evaluation_.infeasibility);
  const double resolution =
      settings_.line_search.cost_resolution * std::max(1.0, std::abs(before_.total()));
  return predicted > resolution ? actual / predicted : std::numeric_limits<double>::quiet_NaN();
}

/// Whether the curvature of the Lagrangian at the iterate is negative somewhere along the rows.
/// Hard rows are left out of the question: which of them are active would have to be known.
bool Sqp::is_saddle(const IterationRecord& record) {
  if (!is_exact() || !qp_solver_->capabilities().tells_inertia) return false;
  if (record.is_exact && record.damping <= settings_.damping.smallest) return false;
  if (transcription_->qp().has_hard_rows()) return false;
  IterationRecord unused;
  use_gauss_newton_hessians(unused);
  use_exact_hessians(unused);
  damping_.measure(transcription_->qp());
  transcription_->regularize(settings_.damping.smallest, damping_.scale());
  StageQpSolution step = solution_;
  for (Eigen::VectorXd& w : step.w) w.setZero();
  // Of its own: the solver's factors and gain stay those of the last QP.
  const auto solver = make_qp_solver(settings_.qp, settings_.qp_settings);
  PenaltySubproblem subproblem(settings_.subproblem, settings_.qp_settings.structured.kernels);
  const PenaltySubproblemResult result = subproblem.solve(transcription_->qp(), *solver, step);
  return result.status == QpStatus::FactorizationFailed;
}

}  // namespace palanquin
