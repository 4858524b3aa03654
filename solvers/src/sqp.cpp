#include "palanquin/solvers/sqp.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "palanquin/solvers/qp_factory.hpp"
#include "setting_rules.hpp"
#include "stopwatch.hpp"

namespace palanquin {

namespace {
const SqpSettings& checked(const SqpSettings& settings) {
  if (const std::string reason = settings.explain_invalid(); !reason.empty())
    throw std::invalid_argument(reason);
  return settings;
}
}  // namespace

Sqp::Sqp(std::shared_ptr<const LoweredProblem> problem, int horizon, const SqpSettings& settings)
    : settings_(checked(settings)),
      transcription_(std::move(problem), horizon, settings.form, settings.threads),
      qp_solver_(make_qp_solver(settings.qp, settings.qp_settings)),
      subproblem_(settings.subproblem) {
  trial_ = iterate_ = neutral_trajectory(transcription_.problem(), horizon);
  history_.reserve(static_cast<std::size_t>(settings.max_iterations));
}

void Sqp::set_policy(const std::string& family, const Policy& policy) {
  transcription_.set_policy(family, policy);
}

Status Sqp::solve(MatrixView parameters, VectorView measured, MatrixView guess) {
  if (!start(parameters, measured, guess)) return status_;
  while (status_ == Status::NotSolved) {
    history_.push_back(iterate());
    const IterationRecord& last = history_.back();
    if (status_ != Status::NotSolved) break;
    if (is_converged(last))
      finish(Status::Converged, "predicted decrease and residuals are within tolerance");
    else if (static_cast<int>(history_.size()) == settings_.max_iterations)
      finish(Status::IterationLimit, "all iterations were taken");
  }
  return status_;
}

/// Takes over the inputs; false when a function is not finite at the guess.
bool Sqp::start(MatrixView parameters, VectorView measured, MatrixView guess) {
  history_.clear();
  status_ = Status::NotSolved;
  message_.clear();
  evaluation_ = Evaluation{};
  transcription_.set_parameters(parameters);
  transcription_.set_measured(measured);
  iterate_ = guess;
  transcription_.project(iterate_);
  if (!iterate_.allFinite()) {
    finish(Status::NonFinite, "the guess holds values that are not finite");
    return false;
  }
  transcription_.place_initial_state(iterate_);
  return true;
}

IterationRecord Sqp::iterate() {
  IterationRecord record;
  // 1. Linearise.
  Stopwatch watch;
  const NonFinite bad = transcription_.linearize(iterate_);
  record.times.linearize = watch.lap_ms();
  if (bad.found) {
    finish(Status::NonFinite, bad.message);
    return record;
  }
  evaluation_ = transcription_.evaluate(iterate_);
  record.times.globalize = watch.lap_ms();

  // 2. and 3. Solve and step, a second time with a proximal term when the plain step fails.
  if (!try_step(record, 0.0) && !try_step(record, settings_.regularization)) {
    record.step = StepKind::Rejected;
    const bool feasible = evaluation_.equality_max <= settings_.equality_tolerance &&
                          evaluation_.inequality_max <= settings_.equality_tolerance;
    if (feasible)
      finish(Status::Stalled, "no step length was accepted from a feasible point");
    else if (is_usable(record.qp_status) || record.qp_status == QpStatus::PrimalInfeasible)
      finish(Status::Infeasible, "the constraints cannot be met");
    else
      finish(Status::QpFailed, "the QP back end '" + std::string(qp_solver_->name()) +
                                   "' answered: " + std::string(to_string(record.qp_status)));
  }
  record.cost = evaluation_.cost;
  record.penalty = evaluation_.penalty;
  record.equality_max = evaluation_.equality_max;
  return record;
}

bool Sqp::try_step(IterationRecord& record, double regularization) {
  Stopwatch watch;
  if (regularization > 0.0) transcription_.regularize(regularization);
  const StageQp& qp = transcription_.qp();
  solution_.resize(qp);
  for (Eigen::VectorXd& w : solution_.w) w.setZero();
  const double cost_before = evaluate_cost(qp, solution_.w);
  const PenaltySubproblemResult result = subproblem_.solve(qp, *qp_solver_, solution_);
  record.qp_status = result.status;
  record.inner_iterations += result.iterations;
  record.times.update += result.update_ms;
  record.times.solve += watch.lap_ms() - result.update_ms;
  if (!is_usable(result.status)) return false;
  record.predicted = evaluate_cost(qp, solution_.w) - cost_before;

  const bool accepted = search_step(record);
  record.times.globalize += watch.lap_ms();
  if (accepted && regularization > 0.0) record.step = StepKind::Regularized;
  return accepted;
}

/// Backtracks from the full step until the filter accepts.
bool Sqp::search_step(IterationRecord& record) {
  const Merit current{evaluation_.infeasibility, evaluation_.total()};
  for (double alpha = 1.0; alpha >= settings_.line_search.min_step;
       alpha *= settings_.line_search.contraction) {
    transcription_.step(iterate_, solution_, alpha, trial_);
    trial_evaluation_ = transcription_.evaluate(trial_);
    const Merit trial{trial_evaluation_.infeasibility, trial_evaluation_.total()};
    const bool accepted =
        trial_evaluation_.is_finite &&
        (!settings_.globalize ||
         is_step_acceptable(settings_.line_search, current, trial, alpha, record.predicted));
    if (!accepted) continue;
    iterate_.swap(trial_);
    evaluation_ = trial_evaluation_;
    record.step_length = alpha;
    record.step = alpha == 1.0 ? StepKind::Full : StepKind::Damped;
    return true;
  }
  return false;
}

bool Sqp::is_converged(const IterationRecord& record) const {
  const double scale = std::max(1.0, std::abs(evaluation_.total()));
  return record.step == StepKind::Full &&
         std::abs(record.predicted) <= settings_.cost_tolerance * scale &&
         evaluation_.equality_max <= settings_.equality_tolerance &&
         evaluation_.inequality_max <= settings_.equality_tolerance;
}

void Sqp::finish(Status status, std::string message) {
  status_ = status;
  message_ = std::move(message);
}

PhaseTimes Sqp::times() const {
  PhaseTimes sum;
  for (const IterationRecord& record : history_) {
    sum.linearize += record.times.linearize;
    sum.update += record.times.update;
    sum.solve += record.times.solve;
    sum.globalize += record.times.globalize;
  }
  return sum;
}

std::string_view to_string(StepKind kind) {
  switch (kind) {
    case StepKind::Full: return "full";
    case StepKind::Damped: return "damped";
    case StepKind::Regularized: return "regularized";
    case StepKind::Rejected: return "rejected";
  }
  return "unknown";
}

std::string SqpSettings::explain_invalid() const {
  return SettingRules("sqp.")
      .at_least("threads", threads, 1)
      .at_least("max_iterations", max_iterations, 1)
      .positive("cost_tolerance", cost_tolerance)
      .positive("equality_tolerance", equality_tolerance)
      .positive("regularization", regularization)
      .nested(line_search.explain_invalid())
      .nested(subproblem.explain_invalid())
      .nested(qp_settings.explain_invalid())
      .sentence();
}

std::string LineSearchSettings::explain_invalid() const {
  return SettingRules("line_search.")
      .positive("max_infeasibility", max_infeasibility)
      .positive("min_infeasibility", min_infeasibility)
      .positive("infeasibility_decrease", infeasibility_decrease)
      .positive("cost_decrease", cost_decrease)
      .positive("armijo", armijo)
      .check(contraction > 0.0 && contraction < 1.0, "contraction", contraction, "in (0, 1)")
      .check(min_step > 0.0 && min_step <= 1.0, "min_step", min_step, "in (0, 1]")
      .sentence();
}

}  // namespace palanquin
