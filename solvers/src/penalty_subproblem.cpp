#include "palanquin/solvers/penalty_subproblem.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "linear_rows.hpp"
#include "palanquin/core/setting_rules.hpp"
#include "penalty_segment.hpp"

namespace palanquin {
namespace {

/// A start that violates a row by more than this is not on the rows.
constexpr double kRowTolerance = 1e-9;

/// point += alpha (target - point); the target is used up.
void blend(double alpha, StageQpSolution& target, StageQpSolution& point) {
  if (alpha == 1.0) return std::swap(target, point);
  const auto blend_list = [alpha](const auto& from, auto& to) {
    for (std::size_t k = 0; k < to.size(); ++k) to[k] += alpha * (from[k] - to[k]);
  };
  blend_list(target.w, point.w);
  blend_list(target.dynamics_multiplier, point.dynamics_multiplier);
  blend_list(target.equality_multiplier, point.equality_multiplier);
  blend_list(target.inequality_multiplier, point.inequality_multiplier);
  blend_list(target.link_multiplier, point.link_multiplier);
}

}  // namespace

std::string PenaltySubproblemSettings::explain_invalid() const {
  return SettingRules("subproblem.")
      .at_least("max_inner_iterations", max_inner_iterations, 1)
      .not_negative("tolerance", tolerance)
      .not_negative("decrease_tolerance", decrease_tolerance)
      .sentence();
}

PenaltySubproblem::PenaltySubproblem(const PenaltySubproblemSettings& settings, KernelLevel level)
    : settings_(settings), segment_(std::make_unique<PenaltySegment>(level)) {
  if (const std::string sentence = settings.explain_invalid(); !sentence.empty())
    throw std::invalid_argument(sentence);
}

PenaltySubproblem::~PenaltySubproblem() = default;

PenaltySubproblemResult PenaltySubproblem::solve(const StageQp& qp, QpSolver& solver,
                                                 StageQpSolution& solution) {
  segment_->start(qp, solution.w);
  model_.resize(qp);
  segment_->expand(model_);
  return run(qp, solver, solution, true, false);
}

QpStatus PenaltySubproblem::prepare(const StageQp& qp, QpSolver& solver,
                                    StageQpSolution& solution) {
  solution.resize(qp);
  for (Eigen::VectorXd& w : solution.w) w.setZero();
  segment_->start(qp, solution.w);
  model_.resize(qp);
  segment_->expand(model_);
  return solver.prepare(qp, model_);
}

PenaltySubproblemResult PenaltySubproblem::finish(const StageQp& qp, QpSolver& solver,
                                                  StageQpSolution& solution) {
  return run(qp, solver, solution, true, true);
}

PenaltySubproblemResult PenaltySubproblem::solve(const StageQp& qp, QpSolver& solver,
                                                 const PenaltyModel& first_model,
                                                 StageQpSolution& solution) {
  segment_->start(qp, solution.w);
  segment_->watch(first_model);
  model_ = first_model;
  return run(qp, solver, solution, false, false);
}

PenaltySubproblemResult PenaltySubproblem::run(const StageQp& qp, QpSolver& solver,
                                               StageQpSolution& solution, bool is_model_local,
                                               bool is_prepared) {
  PenaltySubproblemResult result;
  while (!result.converged && result.iterations < settings_.max_inner_iterations) {
    // (1) The minimiser of the QP with the penalties' quadratics.
    if (solver.capabilities().starts_warm)
      candidate_ = solution;
    else if (solver.capabilities().warm_multipliers)
      candidate_.inequality_multiplier = solution.inequality_multiplier;
    candidate_.resize(qp);
    const QpStatus status = result.iterations > 0 ? solver.resolve(qp, model_, candidate_)
                            : is_prepared         ? solver.finish(qp, model_, candidate_)
                                                  : solver.solve(qp, model_, candidate_);
    ++result.iterations;
    result.update_ms += solver.update_ms();
    result.solve_ms += solver.solve_ms();
    segment_->aim(solution.w, candidate_.w);
    const PenaltySegment::ModelError error = segment_->model_error(model_);
    const double decrease = -(result.predicted_change + segment_->change(1.0));
    if (!is_usable(status) || std::isnan(error.slope) || std::isnan(decrease)) {
      // Later on the point at hand remains good, just not the best.
      const QpStatus failure = is_usable(status) ? QpStatus::NonFinite : status;
      result.status = result.iterations == 1 ? failure : QpStatus::Inaccurate;
      return result;
    }
    if (result.status != QpStatus::Inaccurate) result.status = status;

    // (2) If the model's slopes are the true ones there, nothing remains to be done; if they are
    // close, next to nothing. A back end that stops early comes closer with every call.
    result.converged = error.slope <= settings_.tolerance ||
                       (!solver.capabilities().stops_early &&
                        error.gain <= settings_.decrease_tolerance * decrease);

    // (3) The lowest point of the true cost on the way there.
    double alpha = 1.0;
    const bool may_shorten =
        !result.converged &&
        (result.iterations > 1 || satisfies_rows(qp, solution.w, kRowTolerance, residual_));
    if (may_shorten) {
      const PenaltySegment::Derivatives start = segment_->at(0.0);
      alpha = segment_->minimize(start);
      result.converged = is_model_local && alpha == 0.0;
    }
    blend(alpha, candidate_, solution);
    result.predicted_change += segment_->change(alpha);
    if (result.converged) break;
    segment_->advance(alpha);
    is_model_local = alpha < 1.0;
    if (is_model_local)
      segment_->expand(model_);  // the model misled: its forces are no good
    else
      segment_->update(model_);
  }
  return result;
}

}  // namespace palanquin
