#include "palanquin/solvers/sqp.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "palanquin/core/diagnosis/non_finite.hpp"
#include "palanquin/core/diagnosis/violations.hpp"
#include "palanquin/core/finite.hpp"
#include "palanquin/solvers/qp_factory.hpp"
#include "stopwatch.hpp"

namespace palanquin {

namespace {
const SqpSettings& checked(const SqpSettings& settings) {
  if (const std::string reason = settings.explain_invalid(); !reason.empty())
    throw std::invalid_argument(reason);
  return settings;
}

/// "block 'x' (knot 3)" of the first value that is not finite; empty if all are.
std::string find_non_finite(const LoweredProblem& problem, const RowMatrix& trajectory) {
  if (all_finite(trajectory)) return "";
  for (Eigen::Index k = 0; k < trajectory.rows(); ++k)
    for (const BlockInfo& b : problem.blocks())
      if (!trajectory.row(k).segment(b.offset, b.size).allFinite())
        return "block '" + b.name + "' (knot " + std::to_string(k) + ")";
  return "";
}

/// As the back end takes them.
LinkRows link_rows(const SqpSettings& settings) {
  const bool as_such = make_qp_solver(settings.qp, settings.qp_settings)->capabilities().link_rows;
  return as_such ? LinkRows::Linked : LinkRows::Folded;
}

/// Which row the back end does not take, and what does.
std::string explain_unsupported(const TranscriptionWorkspace& transcription,
                                const QpSolver& solver) {
  const LoweredProblem& problem = transcription.problem();
  const auto takers = [](bool QpCapabilities::* kind) {
    std::string names;
    for (std::string_view name : qp_solver_names())
      if (make_qp_solver(name)->capabilities().*kind)
        names += (names.empty() ? "'" : ", '") + std::string(name) + "'";
    return names;
  };
  const std::string start = "the QP back end '" + std::string(solver.name()) + "' does not take ";
  for (int k = 0; k <= transcription.horizon(); ++k) {
    const KnotShape& shape = transcription.shape(k);
    const StageKind stage = shape.signature.stage;
    if (!solver.capabilities().inequality_rows && !shape.inequality_rows.empty())
      return start + "hard inequalities such as " +
             problem.row_name(stage, RowKind::Inequality, shape.inequality_rows.front(), k) +
             "; give the family a penalty, or use " + takers(&QpCapabilities::inequality_rows);
  }
  return start + "rows of this problem";
}
}  // namespace

Sqp::Sqp(std::shared_ptr<const LoweredProblem> problem, int horizon, const SqpSettings& settings,
         std::shared_ptr<const ExactHessian> exact)
    : settings_(checked(settings)),
      transcription_(
          std::make_shared<const TranscriptionModel>(
              std::move(problem), horizon, settings.form,
              settings.hessian == HessianKind::Exact ? exact : nullptr, link_rows(settings)),
          settings.threads),
      policies_(transcription_.inputs().shared_policies()),
      qp_solver_(make_qp_solver(settings.qp, settings.qp_settings)),
      subproblem_(settings.subproblem) {
  if (settings.hessian == HessianKind::Exact && exact == nullptr)
    throw std::invalid_argument(
        "sqp.hessian is exact, which needs the problem's \"exact\" library");
  trial_ = iterate_ = neutral_trajectory(transcription_.problem(), horizon);
  history_.reserve(static_cast<std::size_t>(std::min(settings.max_iterations, 1000)));
  message_.reserve(256);
}

void Sqp::set_policy(const std::string& family, const Policy& policy) {
  const auto use = user_.change("set_policy");
  const LoweredProblem& problem = transcription_.problem();
  if (policies_->get(problem, family) == policy) return;
  auto changed = std::make_shared<RowPolicies>(*policies_);
  changed->set(problem, family, policy);
  policies_ = std::move(changed);
}

Status Sqp::solve(MatrixView parameters, VectorView measured, MatrixView guess) {
  const auto use = user_.change("solve");
  return run(parameters, measured, guess);
}

Plan Sqp::solve_plan(MatrixView parameters, VectorView measured, MatrixView guess) {
  const auto use = user_.change("solve");
  run(parameters, measured, guess);
  return make_plan();
}

Status Sqp::run(MatrixView parameters, VectorView measured, MatrixView guess) {
  if (!start(parameters, measured, guess)) return status_;
  is_real_time_ = settings_.max_iterations == 1;
  while (status_ == Status::NotSolved) {
    IterationRecord record;
    if (linearize(record)) take_step(record, false);
    history_.push_back(record);
    if (status_ != Status::NotSolved) break;
    if (is_converged(record))
      finish(Status::Converged, "predicted decrease and residuals are within tolerance");
    else if (static_cast<int>(history_.size()) == settings_.max_iterations)
      finish(Status::IterationLimit, "all iterations were taken");
  }
  return status_;
}

bool Sqp::prepare(MatrixView parameters, VectorView predicted, MatrixView guess) {
  const auto use = user_.change("prepare");
  if (!start(parameters, predicted, guess)) return false;
  prepared_ = {};
  if (!linearize(prepared_)) return false;
  Stopwatch watch;
  prepared_.qp_status = subproblem_.prepare(transcription_.qp(), *qp_solver_, solution_);
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
  transcription_.set_measured(measured);
  transcription_.update_initial_state(iterate_);
  is_real_time_ = true;
  IterationRecord record = prepared_;
  take_step(record, is_usable(prepared_.qp_status));
  history_.push_back(record);
  if (status_ == Status::NotSolved) finish(Status::IterationLimit, "all iterations were taken");
  feedback_ms_ = watch.lap_ms();
  return status_;
}

Eigen::MatrixXd Sqp::feedback_gain() const {
  const auto use = user_.read("feedback_gain");
  const Eigen::MatrixXd gain = qp_solver_->feedback_gain();
  if (gain.size() == 0) return {};
  const ColumnMap& columns = transcription_.shape(0).columns;
  Eigen::MatrixXd expanded(transcription_.problem().ndz(), gain.cols());
  Eigen::VectorXd w = Eigen::VectorXd::Zero(columns.nw());
  for (Eigen::Index j = 0; j < gain.cols(); ++j) {
    w.segment(columns.nx, columns.nu) = gain.col(j);
    columns.expand(w.data(), transcription_.slopes(0), expanded.col(j).data());
  }
  return expanded;
}

RowMatrix Sqp::dynamics_multipliers() const {
  const auto use = user_.read("dynamics_multipliers");
  if (is_prepared_)
    throw std::logic_error("dynamics_multipliers: the prepared QP waits for its feedback");
  const int horizon = transcription_.horizon();
  const Eigen::Index size = transcription_.problem().ndx();
  RowMatrix rows = RowMatrix::Zero(horizon, size);
  if (solution_.dynamics_multiplier.empty()) return rows;
  StageQpSolution solution = solution_;
  qp_solver_->find_dynamics_multipliers(solution);
  for (int k = 0; k < horizon; ++k) {
    const Eigen::VectorXd& row = solution.dynamics_multiplier[k + 1];
    if (row.size() != size)
      throw std::logic_error("dynamics_multipliers: knot " + std::to_string(k + 1) +
                             " carries blocks over, whose multipliers have no row here");
    rows.row(k) = row;
  }
  return rows;
}

double Sqp::model_cost() const {
  const auto use = user_.read("model_cost");
  return history_.empty() ? std::numeric_limits<double>::quiet_NaN()
                          : start_cost_ + history_.back().predicted;
}

/// Takes over the inputs; false when a function is not finite at the guess.
bool Sqp::start(MatrixView parameters, VectorView measured, MatrixView guess) {
  Stopwatch watch;
  is_prepared_ = false;
  history_.clear();
  status_ = Status::NotSolved;
  message_.clear();
  evaluation_ = Evaluation{};
  start_cost_ = feedback_ms_ = Evaluation::kNaN;
  transcription_.set_policies(policies_);
  transcription_.set_parameters(parameters);
  transcription_.set_measured(measured);
  iterate_ = guess;
  transcription_.project(iterate_);
  if (const std::string where = find_non_finite(transcription_.problem(), iterate_);
      !where.empty()) {
    finish(Status::NonFinite, "the guess is not finite in " + where);
    return false;
  }
  transcription_.place_initial_state(iterate_);
  transcribe_ms_ = watch.lap_ms();
  return true;
}

/// Step 1. False when a function is not finite.
bool Sqp::linearize(IterationRecord& record) {
  if (history_.empty()) record.times.transcribe = transcribe_ms_;
  Stopwatch watch;
  const NonFinite bad = transcription_.linearize(iterate_);
  record.times.linearize = watch.lap_ms();
  if (bad.found) {
    finish(Status::NonFinite, bad.message);
    return false;
  }
  if (settings_.hessian == HessianKind::Exact) {
    solution_.resize(transcription_.qp());
    transcription_.use_exact_hessians(iterate_, solution_);
    record.times.linearize += watch.lap_ms();
  }
  evaluation_ = transcription_.summarize();
  start_cost_ = evaluation_.total();
  record.times.globalize = watch.lap_ms();
  return true;
}

/// Steps 2 and 3, a second time with a proximal term when the plain step fails.
void Sqp::take_step(IterationRecord& record, bool is_prepared) {
  if (!try_step(record, 0.0, is_prepared) && !try_step(record, settings_.regularization, false))
    keep_iterate(record);
  record.cost = evaluation_.cost;
  record.penalty = evaluation_.penalty;
  record.equality_max = evaluation_.equality_max;
}

/// No step was acceptable. A real-time plan starts at the measurement all the same.
void Sqp::keep_iterate(IterationRecord& record) {
  record.step = StepKind::Rejected;
  if (status_ == Status::NonFinite) return;
  if (is_real_time_) {
    transcription_.place_initial_state(iterate_);
    evaluation_ = transcription_.evaluate(iterate_);
  }
  const bool feasible = evaluation_.equality_max <= settings_.equality_tolerance &&
                        evaluation_.inequality_max <= settings_.equality_tolerance;
  if (is_real_time_ && is_usable(record.qp_status))
    finish(Status::Diverged, "cost or residuals blew up, however short the step");
  else if (feasible)
    finish(Status::Stalled, "no step length was accepted from a feasible point");
  else if (is_usable(record.qp_status) || record.qp_status == QpStatus::PrimalInfeasible)
    finish(Status::Infeasible, "the constraints cannot be met; " + describe_contradiction());
  else
    finish(Status::QpFailed, "the QP back end '" + std::string(qp_solver_->name()) +
                                 "' answered: " + std::string(to_string(record.qp_status)));
}

/// The worst rows of the point that violates a contradicting QP least, or of the iterate.
std::string Sqp::describe_contradiction() {
  const StageQpSolution* nearest = qp_solver_->least_violation();
  if (nearest == nullptr) return describe_worst_rows(iterate_);
  transcription_.step(iterate_, *nearest, 1.0, trial_);
  transcription_.place_initial_state(trial_);
  return describe_worst_rows(trial_);
}

std::string Sqp::describe_worst_rows(const RowMatrix& trajectory) const {
  return palanquin::describe_worst_rows(transcription_.model(), transcription_.inputs(),
                                        trajectory);
}

bool Sqp::try_step(IterationRecord& record, double regularization, bool is_prepared) {
  Stopwatch watch;
  if (regularization > 0.0) transcription_.regularize(regularization);
  const StageQp& qp = transcription_.qp();
  solution_.resize(qp);
  for (Eigen::VectorXd& w : solution_.w) w.setZero();
  const PenaltySubproblemResult result = is_prepared
                                             ? subproblem_.finish(qp, *qp_solver_, solution_)
                                             : subproblem_.solve(qp, *qp_solver_, solution_);
  record.qp_status = result.status;
  record.inner_iterations += result.iterations;
  record.times.update += result.update_ms;
  record.times.solve += watch.lap_ms() - result.update_ms;
  if (result.status == QpStatus::Unsupported)
    throw std::invalid_argument(explain_unsupported(transcription_, *qp_solver_));
  if (!is_usable(result.status)) {
    if (const NonFinite bad = find_non_finite_derivative(transcription_); bad.found)
      finish(Status::NonFinite, bad.message);
    return false;
  }
  record.predicted = result.predicted_change;
  if (settings_.hessian == HessianKind::Exact) qp_solver_->find_dynamics_multipliers(solution_);

  const bool accepted = search_step(record);
  record.times.globalize += watch.lap_ms();
  if (accepted && regularization > 0.0) record.step = StepKind::Regularized;
  return accepted;
}

/// Backtracks from the full step until one is acceptable. Real-time plans start at the measurement
/// whatever the step length.
bool Sqp::search_step(IterationRecord& record) {
  for (double alpha = 1.0; alpha >= settings_.line_search.min_step;
       alpha *= settings_.line_search.contraction) {
    transcription_.step(iterate_, solution_, alpha, trial_);
    if (is_real_time_) transcription_.place_initial_state(trial_);
    trial_evaluation_ = transcription_.evaluate(trial_);
    if (!trial_evaluation_.is_finite || !is_acceptable(alpha, record)) continue;
    iterate_.swap(trial_);
    evaluation_ = trial_evaluation_;
    record.step_length = alpha;
    record.step = alpha == 1.0 ? StepKind::Full : StepKind::Damped;
    return true;
  }
  return false;
}

bool Sqp::is_acceptable(double alpha, IterationRecord& record) const {
  if (!settings_.globalize) return true;
  const Merit current{evaluation_.infeasibility, evaluation_.total()};
  const Merit trial{trial_evaluation_.infeasibility, trial_evaluation_.total()};
  if (is_real_time_)
    return !has_diverged(settings_.line_search, current, trial, start_cost_ + record.predicted);
  if (!is_step_acceptable(settings_.line_search, current, trial, alpha, record.predicted))
    return false;
  if (alpha < 1.0 || !is_cycle(trial)) return true;
  record.refused_cycle = true;
  return false;
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

bool Sqp::is_converged(const IterationRecord& record) const {
  const double scale = std::max(1.0, std::abs(evaluation_.total()));
  return record.step == StepKind::Full &&
         std::abs(record.predicted) <= settings_.cost_tolerance * scale &&
         evaluation_.equality_max <= settings_.equality_tolerance &&
         evaluation_.inequality_max <= settings_.equality_tolerance;
}

void Sqp::finish(Status status, std::string_view message) {
  status_ = status;
  message_ = message;
  if (status == Status::NonFinite) evaluation_ = Evaluation{};
}

// ---- results ----------------------------------------------------------------------------------

Status Sqp::status() const {
  const auto use = user_.read("status");
  return status_;
}

bool Sqp::has_usable_plan() const {
  const auto use = user_.read("has_usable_plan");
  return is_usable(status_, evaluation_, settings_.usable_violation);
}

const std::string& Sqp::message() const {
  const auto use = user_.read("message");
  return message_;
}

const RowMatrix& Sqp::trajectory() const {
  const auto use = user_.read("trajectory");
  return iterate_;
}

const Evaluation& Sqp::evaluation() const {
  const auto use = user_.read("evaluation");
  return evaluation_;
}

const std::vector<IterationRecord>& Sqp::history() const {
  const auto use = user_.read("history");
  return history_;
}

double Sqp::feedback_ms() const {
  const auto use = user_.read("feedback_ms");
  return feedback_ms_;
}

PhaseTimes Sqp::times() const {
  const auto use = user_.read("times");
  return sum_of(history_);
}

Plan Sqp::plan() const {
  const auto use = user_.read("plan");
  return make_plan();
}

Plan Sqp::make_plan() const {
  Plan plan(transcription_.shared_model());
  plan.inputs = transcription_.inputs();
  plan.trajectory = iterate_;
  plan.status = status_;
  plan.message = message_;
  plan.evaluation = evaluation_;
  plan.usable_violation = settings_.usable_violation;
  plan.history = history_;
  plan.iterations = static_cast<int>(history_.size());
  plan.times = sum_of(history_);
  plan.feedback_ms = feedback_ms_;
  return plan;
}

PhaseTimes sum_of(const std::vector<IterationRecord>& history) {
  PhaseTimes sum;
  for (const IterationRecord& record : history) {
    sum.transcribe += record.times.transcribe;
    sum.linearize += record.times.linearize;
    sum.update += record.times.update;
    sum.solve += record.times.solve;
    sum.globalize += record.times.globalize;
  }
  return sum;
}

std::string_view to_string(StepKind kind) {
  switch (kind) {
    case StepKind::Full:
      return "full";
    case StepKind::Damped:
      return "damped";
    case StepKind::Regularized:
      return "regularized";
    case StepKind::Rejected:
      return "rejected";
  }
  return "unknown";
}

}  // namespace palanquin
