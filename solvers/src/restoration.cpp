#include "palanquin/solvers/restoration.hpp"

#include <algorithm>
#include <cmath>

#include "palanquin/core/setting_rules.hpp"
#include "palanquin/solvers/qp_factory.hpp"

namespace palanquin {
namespace {

constexpr double kLargestProximal = 1e10;
constexpr double kBalancedProximal = 1.0;  // rows and proximal term weigh the same
constexpr double kElasticStiffness = 1e4;  // of the rows, when the cost has its say too

/// Appends column `j` of `block`, its rows moved down by `shift`, times `sign`.
void append_column(const SparseBlock& block, int j, int shift, double sign, SparseBlock& target) {
  if (j >= block.cols) return;  // a block without rows may have no columns either
  for (int e = block.column_start[j]; e < block.column_start[j + 1]; ++e)
    target.push(shift + block.row_index[e], sign * block.values[e]);
}

/// The rows of a stage as penalised ones: hard rows, then e and -e, a hinge on each side.
void penalize_rows(const QpStage& stage, double stiffness, bool with_penalties, QpStage& relaxed) {
  const int soft = with_penalties ? stage.penalty_jacobian.rows : 0;
  const int hard = stage.inequality_jacobian.rows;
  const int equal = stage.equality_jacobian.rows;
  SparseBlock& jacobian = relaxed.penalty_jacobian;
  jacobian.begin(soft + hard + 2 * equal);
  for (int j = 0; j < stage.nw(); ++j) {
    if (with_penalties) append_column(stage.penalty_jacobian, j, 0, 1.0, jacobian);
    append_column(stage.inequality_jacobian, j, soft, 1.0, jacobian);
    append_column(stage.equality_jacobian, j, soft + hard, 1.0, jacobian);
    append_column(stage.equality_jacobian, j, soft + hard + equal, -1.0, jacobian);
    jacobian.end_column();
  }
  relaxed.penalty_value.resize(jacobian.rows);
  relaxed.penalty_value << stage.penalty_value.head(soft), stage.inequality_value,
      stage.equality_value, -stage.equality_value;
  relaxed.penalty_policy.assign(stage.penalty_policy.begin(), stage.penalty_policy.begin() + soft);
  relaxed.penalty_policy.resize(static_cast<std::size_t>(jacobian.rows),
                                {PolicyKind::SquaredHinge, 0.5 * stiffness, 0.0});
}

/// The largest squared norm of a hard or equality row; 0 without rows.
double largest_row(const StageQp& qp) {
  double most = 0.0;
  Eigen::VectorXd squares;
  for (const QpStage& stage : qp.stages)
    for (const SparseBlock* block : {&stage.equality_jacobian, &stage.inequality_jacobian}) {
      squares.setZero(block->rows);
      for (std::size_t e = 0; e < block->values.size(); ++e)
        squares[block->row_index[e]] += block->values[e] * block->values[e];
      if (squares.size() > 0) most = std::max(most, squares.maxCoeff());
    }
  return most;
}

double violation_at(const StageQp& qp, const std::vector<Eigen::VectorXd>& w) {
  double squared = 0.0;
  Eigen::VectorXd rows;
  for (std::size_t k = 0; k < qp.stages.size(); ++k) {
    const QpStage& stage = qp.stages[k];
    rows = stage.equality_value;
    stage.equality_jacobian.multiply_add(w[k].data(), rows.data());
    squared += rows.squaredNorm();
    rows = stage.inequality_value;
    stage.inequality_jacobian.multiply_add(w[k].data(), rows.data());
    squared += rows.cwiseMax(0.0).squaredNorm();
  }
  return std::sqrt(squared);
}

PenaltySubproblemSettings exact_penalties() {
  PenaltySubproblemSettings settings;
  settings.max_inner_iterations = 50;
  settings.decrease_tolerance = 1e-6;
  return settings;
}

}  // namespace

std::string RestorationSettings::explain_invalid() const {
  return SettingRules("restoration.")
      .positive("proximal", proximal)
      .check(certificate > 0.0 && certificate < 1.0, "certificate", certificate, "in (0, 1)")
      .sentence();
}

Restoration::Restoration(const RestorationSettings& settings, const QpSettings& qp_settings)
    : settings_(settings),
      qp_settings_(qp_settings),
      subproblem_(exact_penalties(), qp_settings.structured.kernels) {
  reset();
}

void Restoration::reset() {
  proximal_ = settings_.proximal;
  row_norm_ = 0.0;
  random_.seed(1);
}

bool Restoration::shorten() {
  proximal_ *= 10.0;
  return proximal_ <= kLargestProximal;
}

void Restoration::lengthen() { proximal_ = std::max(settings_.proximal, 0.1 * proximal_); }

bool Restoration::is_negligible(double before, double after) const {
  return before * before - after * after <= settings_.certificate * before * before;
}

/// The structured back end, or one that takes link rows where there are some.
void Restoration::choose_back_end(const StageQp& qp) {
  const bool has_links = std::any_of(qp.stages.begin(), qp.stages.end(), [](const QpStage& stage) {
    return stage.link_value.size() > 0;
  });
  const std::string name = has_links ? "ldl" : "structured";
  if (solver_ == nullptr || solver_->name() != name) solver_ = make_qp_solver(name, qp_settings_);
}

void Restoration::build(const StageQp& qp, const std::vector<Eigen::VectorXd>& scale,
                        double proximal, bool with_cost) {
  double weight = 0.0;
  for (const Eigen::VectorXd& knot : scale)
    if (knot.size() > 0) weight = std::max(weight, knot.maxCoeff());
  row_norm_ = std::max(row_norm_, largest_row(qp));
  stiffness_ = (with_cost ? kElasticStiffness : 1.0) * weight / (row_norm_ > 0.0 ? row_norm_ : 1.0);
  relaxed_.stages.resize(qp.stages.size());
  relaxed_.initial_state = qp.initial_state;
  relaxed_.structure_revision = 2 * qp.structure_revision + (with_cost ? 1 : 0);
  for (std::size_t k = 0; k < qp.stages.size(); ++k) {
    QpStage& stage = relaxed_.stages[k];
    stage = qp.stages[k];
    stage.pattern = -1;
    stage.equality_jacobian.begin(0);
    for (int j = 0; j < stage.nw(); ++j) stage.equality_jacobian.end_column();
    stage.inequality_jacobian = stage.equality_jacobian;
    stage.equality_value.resize(0);
    stage.inequality_value.resize(0);
    penalize_rows(qp.stages[k], stiffness_, with_cost, stage);
    if (!with_cost) {
      // Short steps leave the dynamics' residuals alone: so w = 0 is a candidate, and the rows
      // fall.
      if (proximal >= kBalancedProximal) stage.offset.setZero();
      stage.gradient.setZero();
      std::fill(stage.hessian.values.begin(), stage.hessian.values.end(), 0.0);
    }
    for (int j = 0; j < stage.nw(); ++j)
      stage.hessian.values[static_cast<std::size_t>(
          stage.hessian.column_start[static_cast<std::size_t>(j)])] += proximal * scale[k][j];
  }
}

QpStatus Restoration::solve(const StageQp& qp, const std::vector<Eigen::VectorXd>& scale,
                            bool with_cost, StageQpSolution& step) {
  const QpStatus status = solve(qp, scale, proximal_, with_cost);
  if (is_usable(status))
    for (std::size_t k = 0; k < point_.w.size(); ++k) step.w[k] = point_.w[k];
  return status;
}

/// min  1/2 w'S w + g'w  with random g, so that all variables move by what is little for each.
bool Restoration::random_step(const StageQp& qp, const std::vector<Eigen::VectorXd>& scale,
                              StageQpSolution& step) {
  std::normal_distribution<double> normal;
  choose_back_end(qp);
  build(qp, scale, kBalancedProximal, false);
  for (std::size_t k = 0; k < relaxed_.stages.size(); ++k) {
    QpStage& stage = relaxed_.stages[k];
    std::fill(stage.penalty_jacobian.values.begin(), stage.penalty_jacobian.values.end(), 0.0);
    stage.penalty_value.setConstant(-1.0);
    for (int j = 0; j < stage.nw(); ++j)
      stage.gradient[j] = std::sqrt(scale[k][j]) * normal(random_);
  }
  point_.resize(relaxed_);
  for (Eigen::VectorXd& w : point_.w) w.setZero();
  if (!is_usable(subproblem_.solve(relaxed_, *solver_, point_).status)) return false;
  double largest = 0.0;
  for (const Eigen::VectorXd& w : point_.w)
    if (w.size() > 0) largest = std::max(largest, w.lpNorm<Eigen::Infinity>());
  if (!(largest > 0.0)) return false;
  for (std::size_t k = 0; k < point_.w.size(); ++k) step.w[k] = point_.w[k] / largest;
  return true;
}

StageQpSolution Restoration::certificate(const StageQp& qp) {
  StageQpSolution weights;
  weights.resize(qp);
  solver_->find_dynamics_multipliers(point_);
  const double norm = predicted_ > 0.0 ? predicted_ : 1.0;
  for (std::size_t k = 0; k < qp.stages.size(); ++k) {
    const QpStage& stage = qp.stages[k];
    const double* w = point_.w[k].data();
    Eigen::VectorXd& equality = weights.equality_multiplier[k];
    equality = stage.equality_value;
    stage.equality_jacobian.multiply_add(w, equality.data());
    equality /= norm;
    Eigen::VectorXd& inequality = weights.inequality_multiplier[k];
    inequality = stage.inequality_value;
    stage.inequality_jacobian.multiply_add(w, inequality.data());
    inequality = inequality.cwiseMax(0.0) / norm;
    weights.dynamics_multiplier[k] = point_.dynamics_multiplier[k] / (stiffness_ * norm);
    weights.link_multiplier[k] = point_.link_multiplier[k] / (stiffness_ * norm);
  }
  return weights;
}

bool Restoration::is_stationary_when_balanced(const StageQp& qp,
                                              const std::vector<Eigen::VectorXd>& scale) {
  return is_usable(solve(qp, scale, kBalancedProximal, false)) && is_stationary();
}

QpStatus Restoration::solve(const StageQp& qp, const std::vector<Eigen::VectorXd>& scale,
                            double proximal, bool with_cost) {
  choose_back_end(qp);
  build(qp, scale, proximal, with_cost);
  point_.resize(relaxed_);
  for (Eigen::VectorXd& w : point_.w) w.setZero();
  violation_ = violation_at(qp, point_.w);
  const PenaltySubproblemResult result = subproblem_.solve(relaxed_, *solver_, point_);
  if (is_usable(result.status)) predicted_ = violation_at(qp, point_.w);
  return result.status;
}

}  // namespace palanquin
