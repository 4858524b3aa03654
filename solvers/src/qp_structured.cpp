#include "palanquin/solvers/qp_structured.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "kernels/dispatch.hpp"
#include "palanquin/core/setting_rules.hpp"
#include "stopwatch.hpp"
#include "structured/backward.hpp"
#include "structured/forward.hpp"
#include "structured/refinement.hpp"
#include "structured/workspace.hpp"

namespace palanquin {

using structured::Knot;
using structured::Workspace;

std::string StructuredQpSettings::explain_invalid() const {
  return SettingRules("structured.")
      .not_negative("regularization", regularization)
      .check(pivot_tolerance >= 0.0 && pivot_tolerance < 1.0, "pivot_tolerance", pivot_tolerance,
             "in [0, 1)")
      .positive("equality_weight", equality_weight)
      .positive("equality_tolerance", equality_tolerance)
      .at_least("max_refinements", max_refinements, 1)
      .sentence();
}

namespace {

/// Hard rows are taken where the model replaces them.
bool is_supported(const StageQp& qp, const PenaltyModel& model) {
  for (std::size_t k = 0; k < qp.stages.size(); ++k) {
    const QpStage& stage = qp.stages[k];
    const bool has_hard_rows = stage.inequality_jacobian.rows > 0;
    const bool has_model =
        k < model.slope.size() && model.slope[k].size() > stage.penalty_jacobian.rows;
    if (stage.link_jacobian.rows > 0 || (has_hard_rows && !has_model)) return false;
  }
  return true;
}

bool is_finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

/// Why a pivot failed: the data, or the problem that they make.
QpStatus explain_bad_pivot(const StageQp& qp, const PenaltyModel& model) {
  bool finite = true;
  for (std::size_t k = 0; k < qp.stages.size(); ++k) {
    const QpStage& stage = qp.stages[k];
    for (const SparseBlock* block : {&stage.dynamics, &stage.implicit, &stage.hessian,
                                     &stage.penalty_jacobian, &stage.equality_jacobian})
      finite = finite && is_finite(block->values);
    finite = finite && model.curvature[k].allFinite();
  }
  return finite ? QpStatus::FactorizationFailed : QpStatus::NonFinite;
}

void check_size(const char* what, Eigen::Index found, Eigen::Index expected) {
  if (found != expected)
    throw std::invalid_argument("StructuredQpSolver: " + std::string(what) + " is " +
                                std::to_string(found) + " long, but must be " +
                                std::to_string(expected) + " long");
}

void check_model(const StageQp& qp, const PenaltyModel& model) {
  const auto stages = static_cast<Eigen::Index>(qp.stages.size());
  check_size("model.slope", static_cast<Eigen::Index>(model.slope.size()), stages);
  check_size("model.curvature", static_cast<Eigen::Index>(model.curvature.size()), stages);
  for (std::size_t k = 0; k < qp.stages.size(); ++k) {
    const Eigen::Index rows =
        qp.stages[k].penalty_jacobian.rows + qp.stages[k].inequality_jacobian.rows;
    check_size("model.slope of a knot", model.slope[k].size(), rows);
    check_size("model.curvature of a knot", model.curvature[k].size(), rows);
  }
}

void check_solution(const StageQp& qp, const StageQpSolution& solution) {
  const std::size_t stages = qp.stages.size();
  const auto count = static_cast<Eigen::Index>(stages);
  check_size("solution.w", static_cast<Eigen::Index>(solution.w.size()), count);
  check_size("solution.dynamics_multiplier",
             static_cast<Eigen::Index>(solution.dynamics_multiplier.size()), count);
  check_size("solution.equality_multiplier",
             static_cast<Eigen::Index>(solution.equality_multiplier.size()), count);
  for (std::size_t k = 0; k < stages; ++k) {
    const QpStage& stage = qp.stages[k];
    check_size("solution.w of a knot", solution.w[k].size(), stage.nw());
    check_size("solution.dynamics_multiplier of a knot", solution.dynamics_multiplier[k].size(),
               stage.nx);
    check_size("solution.equality_multiplier of a knot", solution.equality_multiplier[k].size(),
               stage.equality_jacobian.rows);
  }
}

/// Copies the penalties' slopes and curvatures. Returns the last knot at which they differ from the
/// ones copied before, -1 if none does.
int keep_model(const PenaltyModel& model, std::vector<double>& kept) {
  std::size_t size = 0;
  for (const Eigen::VectorXd& slope : model.slope) size += 2 * slope.size();
  const bool comparable = kept.size() == size;
  kept.resize(size);
  int last_changed = -1;
  double* next = kept.data();
  for (std::size_t k = 0; k < model.slope.size(); ++k) {
    for (const Eigen::VectorXd* part : {&model.slope[k], &model.curvature[k]}) {
      const double* end = part->data() + part->size();
      if (!comparable || !std::equal(part->data(), end, next)) last_changed = static_cast<int>(k);
      next = std::copy(part->data(), end, next);
    }
  }
  return last_changed;
}

/// Steps (1) to (5) from knot `last` down to the first.
QpStatus factorize_knots(Workspace& work, const StageQp& qp, const PenaltyModel& model, int last) {
  work.factorized = nullptr;
  work.is_solved = false;
  for (int k = last; k >= 0; --k) {
    if (structured::factorize_knot(work, qp, model, k)) continue;
    work.clear();
    return explain_bad_pivot(qp, model);
  }
  work.factorized = &qp;
  return QpStatus::Solved;
}

/// The largest entry of the Hessians' diagonals, or 1.
double largest_curvature(const StageQp& qp) {
  double largest = 0.0;
  for (const QpStage& stage : qp.stages)
    for (int j = 0; j < stage.hessian.cols; ++j)
      largest = std::max(largest, stage.hessian.values[stage.hessian.column_start[j]]);
  return largest > 0.0 ? largest : 1.0;
}

const Knot& factorized_knot(const Workspace& work, int k) {
  if (work.factorized == nullptr)
    throw std::logic_error("StructuredQpSolver: no factorisation stands");
  return work.knots.at(k);
}

}  // namespace

StructuredQpSolver::StructuredQpSolver(const StructuredQpSettings& settings)
    : workspace_(std::make_unique<Workspace>()) {
  if (const std::string sentence = settings.explain_invalid(); !sentence.empty())
    throw std::invalid_argument(sentence);
  workspace_->settings = settings;
  workspace_->level = resolve_kernel_level(settings.kernels);
  workspace_->kernels = &kernels::kernels_for(workspace_->level);
}

StructuredQpSolver::~StructuredQpSolver() = default;
StructuredQpSolver::StructuredQpSolver(StructuredQpSolver&&) noexcept = default;
StructuredQpSolver& StructuredQpSolver::operator=(StructuredQpSolver&&) noexcept = default;

QpStatus StructuredQpSolver::factorize(const StageQp& qp, const PenaltyModel& model) {
  constexpr double kFlat = 1e-3;  // of the largest curvature, where a knot has next to none
  return factorize(qp, model, kFlat);
}

/// With equality rows held as if they met at least `share` of the largest curvature.
QpStatus StructuredQpSolver::factorize(const StageQp& qp, const PenaltyModel& model, double share) {
  Stopwatch stopwatch;
  Workspace& work = *workspace_;
  work.factorized = nullptr;
  if (!is_supported(qp, model)) return QpStatus::Unsupported;
  if (!work.is_analyzed(qp)) work.analyze(qp);
  check_model(qp, model);
  keep_model(model, work.model);
  work.least_curvature = work.has_equality_rows ? share * largest_curvature(qp) : 0.0;
  const QpStatus status = factorize_knots(work, qp, model, qp.horizon());
  update_ms_ = stopwatch.lap_ms();
  solve_ms_ = 0.0;
  return status;
}

QpStatus StructuredQpSolver::feedback(const Eigen::VectorXd& initial_state,
                                      StageQpSolution& solution) {
  Stopwatch stopwatch;
  Workspace& work = *workspace_;
  check_size("initial_state", initial_state.size(), factorized_knot(work, 0).plan->nx);
  const StageQp& qp = *work.factorized;
  check_solution(qp, solution);
  QpStatus status = QpStatus::NonFinite;
  if (structured::roll_out(work, qp, initial_state))
    status = work.has_equality_rows ? structured::refine_equality_rows(work, qp) : QpStatus::Solved;
  work.is_solved = is_usable(status);
  work.has_multipliers = work.has_equality_rows;
  if (work.is_solved) structured::unpack(work, solution);
  if (status == QpStatus::NonFinite) work.clear();
  solve_ms_ = stopwatch.lap_ms();
  return status;
}

void StructuredQpSolver::find_dynamics_multipliers(StageQpSolution& solution) {
  Workspace& work = *workspace_;
  if (work.factorized == nullptr || !work.is_solved) return;
  check_solution(*work.factorized, solution);
  if (!work.has_multipliers) structured::find_multipliers(work, *work.factorized);
  work.has_multipliers = true;
  for (std::size_t k = 0; k < work.knots.size(); ++k)
    std::copy_n(work.knots[k].multiplier, work.knots[k].plan->nx,
                solution.dynamics_multiplier[k].data());
}

QpStatus StructuredQpSolver::solve(const StageQp& qp, const PenaltyModel& model,
                                   StageQpSolution& solution) {
  QpStatus status = factorize(qp, model);
  if (is_usable(status)) status = feedback(qp.initial_state, solution);
  return status == QpStatus::NotSolved ? solve_stiffly(qp, model, solution) : status;
}

/// Where the rows' own knot costs next to nothing and others do, rows are to be held as stiffly as
/// the others ask for.
QpStatus StructuredQpSolver::solve_stiffly(const StageQp& qp, const PenaltyModel& model,
                                           StageQpSolution& solution) {
  QpStatus status = QpStatus::NotSolved;
  for (const double share : {1.0, 1e2, 1e4}) {
    status = factorize(qp, model, share);
    if (is_usable(status)) status = feedback(qp.initial_state, solution);
    if (status != QpStatus::NotSolved) break;
  }
  return status;
}

QpStatus StructuredQpSolver::resolve(const StageQp& qp, const PenaltyModel& model,
                                     StageQpSolution& solution) {
  Workspace& work = *workspace_;
  if (work.factorized != &qp || !work.is_analyzed(qp)) return solve(qp, model, solution);
  Stopwatch stopwatch;
  check_model(qp, model);
  const QpStatus status = factorize_knots(work, qp, model, keep_model(model, work.model));
  update_ms_ = stopwatch.lap_ms();
  const QpStatus answer = is_usable(status) ? feedback(qp.initial_state, solution) : status;
  return answer == QpStatus::NotSolved ? solve_stiffly(qp, model, solution) : answer;
}

void StructuredQpSolver::set_regularization(double regularization) {
  if (workspace_->settings.regularization != regularization) workspace_->factorized = nullptr;
  workspace_->settings.regularization = regularization;
}

Eigen::MatrixXd StructuredQpSolver::input_gain(int k) const {
  const structured::KnotPlan& plan = *factorized_knot(*workspace_, k).plan;
  Eigen::MatrixXd gain(plan.nu, plan.nx);
  std::vector<double> work;
  write_input_gain(k, gain, work);
  return gain;
}

void StructuredQpSolver::write_input_gain(int k, Eigen::Ref<Eigen::MatrixXd> gain,
                                          std::vector<double>& work) const {
  const Knot& knot = factorized_knot(*workspace_, k);
  const structured::KnotPlan& plan = *knot.plan;
  if (gain.rows() != plan.nu || gain.cols() != plan.nx)
    throw std::invalid_argument("input_gain: the gain of knot " + std::to_string(k) + " is [" +
                                std::to_string(plan.nu) + ", " + std::to_string(plan.nx) + "]");
  constexpr std::size_t kAligned = 8;  // doubles
  work.resize(std::max(work.size(), plan.slots() + kAligned));
  const auto misfit = reinterpret_cast<std::uintptr_t>(work.data()) / sizeof(double) % kAligned;
  double* z = work.data() + (kAligned - misfit) % kAligned;
  for (int j = 0; j < plan.nx; ++j) {
    std::fill_n(z, plan.slots(), 0.0);
    z[plan.state_slot + j] = 1.0;
    structured::solve_inputs(*workspace_, knot, 0.0, z);
    for (int i = 0; i < plan.nu; ++i) gain(i, j) = z[plan.input_slot + i];
  }
}

Eigen::MatrixXd StructuredQpSolver::value_hessian(int k) const {
  const Knot& knot = factorized_knot(*workspace_, k);
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(knot.plan->nx, knot.plan->nx);
  for (int j = 0; j < knot.nx; ++j)
    for (int i = j; i < knot.nx; ++i)
      hessian(i, j) = hessian(j, i) = knot.value[i + j * knot.plan->value_ld];
  return hessian;
}

Eigen::VectorXd StructuredQpSolver::value_gradient(int k) const {
  const Knot& knot = factorized_knot(*workspace_, k);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(knot.plan->nx);
  for (int j = 0; j < knot.nx; ++j) gradient[j] = knot.value[knot.nx + j * knot.plan->value_ld];
  return gradient;
}

double StructuredQpSolver::flops() const {
  const Workspace& work = *workspace_;
  return work.factorized == nullptr ? 0.0 : structured::count_flops(*work.factorized, work.knots);
}

KernelLevel StructuredQpSolver::kernel_level() const { return workspace_->level; }

}  // namespace palanquin
