#include "palanquin/solvers/sqp.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "merit_of.hpp"
#include "multiplier_shift.hpp"
#include "palanquin/core/diagnosis/non_finite.hpp"
#include "palanquin/core/diagnosis/violations.hpp"
#include "palanquin/core/finite.hpp"
#include "palanquin/solvers/qp_factory.hpp"
#include "stopwatch.hpp"
#include "unsupported_rows.hpp"

namespace palanquin {

namespace {
const SqpSettings& checked(const SqpSettings& settings) {
  if (const std::string reason = settings.explain_invalid(); !reason.empty())
    throw std::invalid_argument(reason);
  return settings;
}

/// The first value of a guess that is not finite.
NonFinite find_non_finite(const LoweredProblem& problem, const RowMatrix& guess) {
  if (all_finite(guess)) return {};
  for (int k = 0; k < guess.rows(); ++k)
    for (const BlockInfo& b : problem.blocks())
      if (!guess.row(k).segment(b.offset, b.size).allFinite()) {
        const std::string where = "block '" + b.name + "' (knot " + std::to_string(k) + ")";
        return {true, "the guess is not finite in " + where, "guess", where, k};
      }
  return {};
}

/// As the back end takes them.
LinkRows link_rows(const SqpSettings& settings) {
  const bool as_such = make_qp_solver(settings.qp, settings.qp_settings)->capabilities().link_rows;
  return as_such ? LinkRows::Linked : LinkRows::Folded;
}

double largest_entry(const RowMatrix& trajectory) {
  return trajectory.size() > 0 ? trajectory.cwiseAbs().maxCoeff() : 0.0;
}
}  // namespace

Sqp::Sqp(std::shared_ptr<const LoweredProblem> problem, int horizon, const SqpSettings& settings,
         ExactSource exact)
    : settings_(checked(settings)),
      exact_source_(settings.hessian == HessianKind::GaussNewton ? nullptr : std::move(exact)),
      gauss_newton_(std::make_shared<const TranscriptionModel>(
                        std::move(problem), horizon, settings.form, nullptr, link_rows(settings)),
                    settings.threads),
      policies_(gauss_newton_.inputs().shared_policies()),
      qp_solver_(make_qp_solver(settings.qp, settings.qp_settings)),
      subproblem_(settings.subproblem, settings.qp_settings.structured.kernels),
      damping_(settings.damping),
      restoration_(settings.restoration, settings.qp_settings) {
  if (settings.hessian == HessianKind::Exact && !prepare_exact())
    throw std::invalid_argument(
        "sqp.hessian is exact, which needs the problem's \"exact\" library");
  // A solve with a time limit has no time to compile them.
  if (settings.max_seconds < Deadline::kNoLimit && settings.max_iterations > settings.exact_after)
    prepare_exact();
  trial_ = iterate_ = neutral_trajectory(transcription_->problem(), horizon);
  const auto most = static_cast<std::size_t>(std::min(settings.max_iterations, 1000));
  history_.reserve(most);
  filter_.reserve(most);
  message_.reserve(256);
}

void Sqp::set_policy(const std::string& family, const Policy& policy) {
  const auto use = user_.change("set_policy");
  const LoweredProblem& problem = transcription_->problem();
  if (policies_->get(problem, family) == policy) return;
  auto changed = std::make_shared<RowPolicies>(*policies_);
  changed->set(problem, family, policy);
  policies_ = std::move(changed);
}

Status Sqp::solve(MatrixView parameters, VectorView measured, MatrixView guess,
                  const GoesOn& goes_on) {
  const auto use = user_.change("solve");
  return run(parameters, measured, guess, goes_on);
}

Plan Sqp::solve_plan(MatrixView parameters, VectorView measured, MatrixView guess,
                     const GoesOn& goes_on) {
  const auto use = user_.change("solve");
  run(parameters, measured, guess, goes_on);
  return make_plan();
}

Status Sqp::run(MatrixView parameters, VectorView measured, MatrixView guess,
                const GoesOn& goes_on) {
  deadline_.set(settings_.max_seconds, goes_on);
  if (!start(parameters, measured, guess)) return status_;
  is_real_time_ = settings_.max_iterations == 1;
  while (status_ == Status::NotSolved) {
    IterationRecord record;
    if (linearize(record)) take_step(record, false);
    close(record);
  }
  return status_;
}

bool Sqp::prepare(MatrixView parameters, VectorView predicted, MatrixView guess) {
  const auto use = user_.change("prepare");
  deadline_.clear();
  if (!start(parameters, predicted, guess)) return false;
  prepared_ = {};
  if (!linearize(prepared_)) return false;
  Stopwatch watch;
  prepared_.qp_status = subproblem_.prepare(transcription_->qp(), *qp_solver_, solution_);
  prepared_.times.update = watch.lap_ms();
  is_prepared_ = true;
  return true;
}

Status Sqp::feedback(VectorView measured) {
  const auto use = user_.change("feedback");
  return finish_feedback(measured);
}

Plan Sqp::feedback_plan(VectorView measured) {
  const auto use = user_.change("feedback");
  finish_feedback(measured);
  return make_plan();
}

Status Sqp::finish_feedback(VectorView measured) {
  if (!is_prepared_) throw std::logic_error("feedback: nothing was prepared");
  is_prepared_ = false;
  Stopwatch watch;
  transcription_->set_measured(measured);
  transcription_->update_initial_state(iterate_);
  is_real_time_ = true;
  IterationRecord record = prepared_;
  take_step(record, is_usable(prepared_.qp_status));
  close(record);
  feedback_ms_ = watch.lap_ms();
  return status_;
}

/// Takes over the inputs; false when a function is not finite at the guess.
bool Sqp::start(MatrixView parameters, VectorView measured, MatrixView guess) {
  Stopwatch watch;
  is_prepared_ = false;
  best_evaluation_ = Evaluation{};
  history_.clear();
  status_ = Status::NotSolved;
  message_.clear();
  has_multipliers_ = uses_exact_ = false;
  is_flat_ = settings_.hessian == HessianKind::Exact;
  exact_from_ = exact_pause_ = 0;
  idle_damping_ = 0.0;
  transcription_ = settings_.hessian == HessianKind::Exact ? exact_.get() : &gauss_newton_;
  certificate_ = {};
  non_finite_ = {};
  evaluation_ = Evaluation{};
  start_cost_ = feedback_ms_ = Evaluation::kNaN;
  transcription_->set_policies(policies_);
  transcription_->set_parameters(parameters);
  transcription_->set_measured(measured);
  if (transcription_->qp().has_hard_rows())
    shift_multipliers(find_shift(iterate_, guess), solution_);
  iterate_ = guess;
  transcription_->project(iterate_);
  if (NonFinite bad = find_non_finite(transcription_->problem(), iterate_); bad.found) {
    finish_non_finite(std::move(bad));
    return false;
  }
  transcription_->place_initial_state(iterate_);
  filter_.reset();
  restored_below_ = std::numeric_limits<double>::infinity();
  damping_.reset();
  restoration_.reset();
  escapes_ = 0;
  unboundedness_.reset(largest_entry(iterate_));
  transcribe_ms_ = watch.lap_ms();
  return true;
}

/// Steps 2 to 4.
void Sqp::take_step(IterationRecord& record, bool is_prepared) {
  const bool is_restoring = evaluation_.infeasibility > restored_below_;
  const bool found = is_restoring ? restore(record) || find_step(record, is_prepared)
                                  : find_step(record, is_prepared) || restore(record);
  if (!found) keep_iterate(record);
}

/// Steps 2 and 3, with other Hessians as long as they fail.
bool Sqp::find_step(IterationRecord& record, bool is_prepared) {
  restored_below_ = std::numeric_limits<double>::infinity();
  for (int attempt = 1; goes_on(attempt == 1); ++attempt, is_prepared = false) {
    record.damping = damping_.weight();
    if (solve_qp(record, is_prepared) && search_step(record)) return true;
    if (attempt == settings_.damping.max_attempts || !change_hessians(record)) return false;
  }
  return false;
}

/// Step 2.
bool Sqp::solve_qp(IterationRecord& record, bool is_prepared) {
  Stopwatch watch;
  const StageQp& qp = transcription_->qp();
  solution_.resize(qp);
  for (Eigen::VectorXd& w : solution_.w) w.setZero();
  const PenaltySubproblemResult result = is_prepared
                                             ? subproblem_.finish(qp, *qp_solver_, solution_)
                                             : subproblem_.solve(qp, *qp_solver_, solution_);
  record.qp_status = result.status;
  record.inner_iterations += result.iterations;
  record.fell_back = record.fell_back || qp_solver_->fell_back();
  record.times.update += result.update_ms;
  record.times.solve += watch.lap_ms() - result.update_ms;
  if (result.status == QpStatus::Unsupported)
    throw std::invalid_argument(explain_unsupported(*transcription_, *qp_solver_));
  if (!is_usable(result.status)) {
    if (const NonFinite bad = find_non_finite_derivative(*transcription_); bad.found)
      finish_non_finite(bad);
    return false;
  }
  has_multipliers_ = true;
  record.predicted = result.predicted_change;
  if (!is_real_time_ || is_exact()) qp_solver_->find_dynamics_multipliers(solution_);
  return true;
}

/// Step 3: backtracks from the full step until one is acceptable. Real-time plans start at the
/// measurement whatever the step length.
bool Sqp::search_step(IterationRecord& record) {
  Stopwatch watch;
  bool found = false;
  // Where rows are violated the restoration is better than many short steps.
  const double min_step = settings_.line_search.min_step;
  const double shortest = is_feasible(evaluation_) ? min_step : std::sqrt(min_step);
  for (double alpha = 1.0; !found && alpha >= shortest && goes_on(alpha == 1.0);
       alpha *= settings_.line_search.contraction) {
    try_length(alpha);
    found = trial_evaluation_.is_finite && is_acceptable(alpha, record);
    if (found)
      accept(alpha,
             alpha < 1.0               ? StepKind::Damped
             : damping_.weight() > 0.0 ? StepKind::Regularized
                                       : StepKind::Full,
             record);
  }
  record.times.globalize += watch.lap_ms();
  return found;
}

void Sqp::try_length(double alpha) {
  transcription_->step(iterate_, solution_, alpha, trial_);
  if (is_real_time_) transcription_->place_initial_state(trial_);
  trial_evaluation_ = transcription_->evaluate(trial_);
}

bool Sqp::is_acceptable(double alpha, IterationRecord& record) {
  if (!settings_.globalize) return true;
  const LineSearchSettings& search = settings_.line_search;
  const Merit current = merit_of(evaluation_), trial = merit_of(trial_evaluation_);
  if (is_real_time_) return !has_diverged(search, current, trial, start_cost_ + record.predicted);
  if (!is_step_acceptable(search, current, trial, alpha, record.predicted)) return false;
  if (!filter_.accepts(search, trial)) return false;
  if (alpha == 1.0 && is_cycle(trial)) {
    record.refused_cycle = true;
    return false;
  }
  if (!are_feasible(search, current, trial)) filter_.add(current);
  return true;
}

void Sqp::accept(double alpha, StepKind kind, IterationRecord& record) {
  before_ = evaluation_;
  iterate_.swap(trial_);
  evaluation_ = trial_evaluation_;
  if (deadline_.is_limited()) keep_best();
  record.step_length = alpha;
  record.step = kind;
}

/// No step was acceptable. A real-time plan starts at the measurement all the same.
void Sqp::keep_iterate(IterationRecord& record) {
  record.step = StepKind::Rejected;
  if (status_ != Status::NotSolved) return;
  if (is_real_time_) {
    transcription_->place_initial_state(iterate_);
    evaluation_ = transcription_->evaluate(iterate_);
  }
  const bool is_solved = is_usable(record.qp_status);
  if (deadline_.was_noticed())
    finish_late();
  else if (is_real_time_ && is_solved)
    finish(Status::Diverged, "cost or residuals blew up, however short the step");
  else if (is_solved && is_feasible(evaluation_))
    finish(Status::Stalled, "no step length was accepted from a feasible point");
  else if (!is_real_time_ && !is_feasible(evaluation_))
    finish(Status::Unfinished, "no step lowers cost or residuals, nor are these proved minimal; " +
                                   describe_worst_rows(iterate_));
  else
    finish(Status::QpFailed, "the QP back end '" + std::string(qp_solver_->name()) +
                                 "' answered: " + std::string(to_string(record.qp_status)) +
                                 describe_contradiction());
}

/// The worst rows of the point that violates a contradicting QP least, if the back end has one; of
/// the iterate, where that point is worse.
std::string Sqp::describe_contradiction() {
  const StageQpSolution* nearest = qp_solver_->least_violation();
  if (nearest == nullptr) return "";
  transcription_->step(iterate_, *nearest, 1.0, trial_);
  transcription_->place_initial_state(trial_);
  const bool is_nearer =
      transcription_->evaluate(trial_).infeasibility <= evaluation_.infeasibility;
  return "; " + describe_worst_rows(is_nearer ? trial_ : iterate_);
}

/// Step 5, and what follows from the step for the next one.
void Sqp::close(IterationRecord& record) {
  record.cost = evaluation_.cost;
  record.penalty = evaluation_.penalty;
  record.equality_max = evaluation_.equality_max;
  record.inequality_max = evaluation_.inequality_max;
  if (status_ == Status::NotSolved) {
    if (is_converged(record))
      finish_converged(record);
    else if (!is_real_time_ && is_unbounded())
      finish(Status::Unbounded, "the cost falls without end: the trajectory has reached " +
                                    std::to_string(largest_entry(iterate_)));
    else if (static_cast<int>(history_.size()) + 1 >= settings_.max_iterations)
      finish_at_limit();
    else if (deadline_.has_passed())
      finish_late();
    else
      update_damping(record);
  }
  history_.push_back(record);
  if (status_ != Status::NotSolved) mention_measured_rows();
}

bool Sqp::is_unbounded() {
  return unboundedness_.update(before_.total(), evaluation_.total(), largest_entry(iterate_),
                               settings_.unbounded_size);
}

void Sqp::finish_converged(const IterationRecord& record) {
  if (is_saddle(record))
    finish(Status::Saddle,
           "stationary, but no minimum: the Lagrangian's curvature is negative along the rows");
  else
    finish(Status::Converged, "predicted decrease, residuals and gradient are within tolerance");
}

void Sqp::finish_at_limit() {
  const double residual = std::max(evaluation_.equality_max, evaluation_.inequality_max);
  if (residual <= settings_.usable_violation)
    finish(Status::IterationLimit, "all iterations were taken");
  else
    finish(Status::Unfinished, "all iterations were taken, and residuals are above " +
                                   std::to_string(settings_.usable_violation) + "; " +
                                   describe_worst_rows(iterate_));
}

bool Sqp::is_feasible(const Evaluation& evaluation) const {
  return evaluation.equality_max <= settings_.equality_tolerance &&
         evaluation.inequality_max <= settings_.equality_tolerance;
}

/// Late or not, one QP is solved and its full step tried: a plan must answer to its measurement.
bool Sqp::goes_on(bool is_first_try) {
  return (is_first_try && history_.empty()) || !deadline_.has_passed();
}

/// Best is what the exact penalty function M = phi + |multipliers| theta says is.
void Sqp::keep_best() {
  const double weight = std::max(1.0, multiplier_norm(solution_));
  const auto merit = [&](const Evaluation& e) { return e.total() + weight * e.infeasibility; };
  if (merit(best_evaluation_) <= merit(evaluation_)) return;  // false while there is none: NaN
  best_ = iterate_;
  best_evaluation_ = evaluation_;
}

void Sqp::finish_late() {
  if (best_evaluation_.is_finite) {
    iterate_ = best_;
    evaluation_ = best_evaluation_;
  }
  const std::string end = deadline_.was_stopped() ? "the solve was stopped" : "the time was up";
  finish(Status::TimeLimit, end + " after " + std::to_string(history_.size() + 1) +
                                " iterations; " + describe_worst_rows(iterate_));
}

/// Whether a full step would lead back to where the iteration was two steps ago: two linearisations
/// that send each other to and fro, which the filter does not see.
bool Sqp::is_cycle(const Merit& trial) const {
  if (history_.size() < 2) return false;
  const IterationRecord& before = history_[history_.size() - 2];
  const auto equal = [](double a, double b) {
    return std::abs(a - b) <= 1e-9 * std::max(1.0, std::abs(b));
  };
  const IterationRecord& last = history_.back();
  const double scale = std::max(1.0, std::abs(trial.cost));
  const bool has_moved = std::abs(last.cost + last.penalty - trial.cost) > 1e-6 * scale;
  return has_moved && equal(trial.cost, before.cost + before.penalty);
}

/// Looks at the gradient only when all else is within tolerance: it costs a pass over the QP.
bool Sqp::is_converged(IterationRecord& record) {
  const double scale = std::max(1.0, std::abs(evaluation_.total()));
  if (record.step == StepKind::Restored || record.step == StepKind::Rejected ||
      !(std::abs(record.predicted) <= settings_.cost_tolerance * scale) ||
      !is_feasible(evaluation_))
    return false;
  qp_solver_->find_dynamics_multipliers(solution_);
  const KktError error = kkt_.evaluate(transcription_->qp(), solution_);
  record.stationarity = std::max(error.stationarity, error.complementarity);
  // The multipliers are as good as the QP's solution is.
  constexpr double kMultiplierError = 5.0;
  return record.stationarity <=
         std::max(settings_.stationarity_tolerance, kMultiplierError * qp_solver_->accuracy());
}

void Sqp::finish_non_finite(NonFinite found) {
  finish(Status::NonFinite, found.message);
  non_finite_ = std::move(found);
}

void Sqp::finish(Status status, std::string_view message) {
  status_ = status;
  message_ = message;
  if (status == Status::NonFinite) evaluation_ = Evaluation{};
}

}  // namespace palanquin
