#include "palanquin/core/stage_qp.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace palanquin {
namespace {

/// largest = max(largest, |r|_inf), where a NaN on either side stays.
void grow(double& largest, const Eigen::VectorXd& r) {
  for (double entry : r)
    if (!(std::abs(entry) <= largest) && !std::isnan(largest)) largest = std::abs(entry);
}

/// h = penalty_value + penalty_jacobian w
void penalty_rows(const QpStage& stage, const Eigen::VectorXd& w, Eigen::VectorXd& h) {
  h = stage.penalty_value;
  stage.penalty_jacobian.multiply_add(w.data(), h.data());
}

/// F_k w_k + b_k - (I - N_k) x_{k+1}
Eigen::VectorXd dynamics_defect(const QpStage& stage, const Eigen::VectorXd& w,
                                const Eigen::VectorXd& next_x) {
  Eigen::VectorXd r = stage.offset - next_x;
  stage.dynamics.multiply_add(w.data(), r.data());
  stage.implicit.multiply_add(next_x.data(), r.data());
  return r;
}

/// C_k w_k + e_k
Eigen::VectorXd equality_residual(const QpStage& stage, const Eigen::VectorXd& w) {
  Eigen::VectorXd r = stage.equality_value;
  stage.equality_jacobian.multiply_add(w.data(), r.data());
  return r;
}

/// P_k w_{k-1} + E_k w_k + c_k
Eigen::VectorXd link_residual(const QpStage& stage, const Eigen::VectorXd& w_previous,
                              const Eigen::VectorXd& w) {
  Eigen::VectorXd r = stage.link_value;
  stage.link_previous.multiply_add(w_previous.data(), r.data());
  stage.link_jacobian.multiply_add(w.data(), r.data());
  return r;
}

}  // namespace

int new_pattern() {
  static std::atomic<int> next{0};
  return next++;
}

bool StageQp::has_hard_rows() const {
  return std::any_of(stages.begin(), stages.end(),
                     [](const QpStage& stage) { return stage.inequality_jacobian.rows > 0; });
}

Eigen::VectorXd SpareVectors::take(Eigen::Index size) {
  const auto fits = [size](const Eigen::VectorXd& v) { return v.size() == size; };
  const auto found = std::find_if(vectors_.rbegin(), vectors_.rend(), fits);
  if (found == vectors_.rend()) return Eigen::VectorXd::Zero(size);
  std::swap(*found, vectors_.back());
  Eigen::VectorXd taken = std::move(vectors_.back());
  vectors_.pop_back();
  taken.setZero();
  return taken;
}

void StageQpSolution::resize(const StageQp& qp) {
  const auto fit = [&](std::vector<Eigen::VectorXd>& list, auto size) {
    spare.resize(list, qp.stages.size(), [&](std::size_t k) { return size(qp.stages[k]); });
  };
  fit(w, [](const QpStage& stage) { return stage.nw(); });
  fit(dynamics_multiplier, [](const QpStage& stage) { return stage.nx; });
  fit(equality_multiplier, [](const QpStage& stage) { return stage.equality_value.size(); });
  fit(inequality_multiplier, [](const QpStage& stage) { return stage.inequality_value.size(); });
  fit(link_multiplier, [](const QpStage& stage) { return stage.link_value.size(); });
}

void PenaltyModel::resize(const StageQp& qp) {
  const auto rows = [&](std::size_t k) { return qp.stages[k].penalty_value.size(); };
  spare.resize(slope, qp.stages.size(), rows);
  spare.resize(curvature, qp.stages.size(), rows);
}

void PenaltyModel::expand(const StageQp& qp, const std::vector<Eigen::VectorXd>& w) {
  resize(qp);
  for (std::size_t k = 0; k < qp.stages.size(); ++k) {
    const QpStage& stage = qp.stages[k];
    penalty_rows(stage, w[k], slope[k]);
    for (Eigen::Index j = 0; j < slope[k].size(); ++j) {
      const double h = slope[k][j];
      const PenaltyValue s = evaluate_penalty(stage.penalty_policy[j], h);
      curvature[k][j] = s.curvature;
      slope[k][j] = s.slope - s.curvature * (h - stage.penalty_value[j]);
    }
  }
}

double evaluate_cost(const StageQp& qp, const std::vector<Eigen::VectorXd>& w) {
  double cost = 0.0;
  Eigen::VectorXd hw, h;
  for (std::size_t k = 0; k < qp.stages.size(); ++k) {
    const QpStage& stage = qp.stages[k];
    hw.setZero(stage.nw());
    stage.hessian.multiply_symmetric_add(w[k].data(), hw.data());
    cost += 0.5 * hw.dot(w[k]) + stage.gradient.dot(w[k]);
    penalty_rows(stage, w[k], h);
    for (Eigen::Index j = 0; j < h.size(); ++j)
      cost += evaluate_penalty(stage.penalty_policy[j], h[j]).value;
  }
  return cost;
}

void lagrangian_gradient(const StageQp& qp, const PenaltyModel& model, const StageQpSolution& s,
                         int k, Eigen::Ref<Eigen::VectorXd> gradient,
                         Eigen::Ref<Eigen::VectorXd> rows) {
  const QpStage& stage = qp.stages[k];
  double* r = gradient.data();
  gradient = stage.gradient;
  stage.hessian.multiply_symmetric_add(s.w[k].data(), r);

  rows.setZero();
  stage.penalty_jacobian.multiply_add(s.w[k].data(), rows.data());
  rows = model.slope[k] + model.curvature[k].cwiseProduct(rows);
  stage.penalty_jacobian.multiply_transposed_add(rows.data(), r);

  stage.equality_jacobian.multiply_transposed_add(s.equality_multiplier[k].data(), r);
  stage.inequality_jacobian.multiply_transposed_add(s.inequality_multiplier[k].data(), r);
  stage.link_jacobian.multiply_transposed_add(s.link_multiplier[k].data(), r);
  gradient.head(stage.nx) -= s.dynamics_multiplier[k];
  if (k > 0) qp.stages[k - 1].implicit.multiply_transposed_add(s.dynamics_multiplier[k].data(), r);
  if (k < qp.horizon()) {
    stage.dynamics.multiply_transposed_add(s.dynamics_multiplier[k + 1].data(), r);
    qp.stages[k + 1].link_previous.multiply_transposed_add(s.link_multiplier[k + 1].data(), r);
  }
}

double KktResidual::max() const { return std::max({stationarity, dynamics, equality}); }

KktResidual kkt_residual(const StageQp& qp, const PenaltyModel& model,
                         const StageQpSolution& solution) {
  KktResidual residual;
  const auto& w = solution.w;
  grow(residual.dynamics, qp.initial_state - w[0].head(qp.stages[0].nx));
  for (int k = 0; k <= qp.horizon(); ++k) {
    const QpStage& stage = qp.stages[k];
    Eigen::VectorXd gradient(stage.nw()), rows(stage.penalty_value.size());
    lagrangian_gradient(qp, model, solution, k, gradient, rows);
    grow(residual.stationarity, gradient);
    grow(residual.equality, equality_residual(stage, w[k]));
    if (k > 0) grow(residual.equality, link_residual(stage, w[k - 1], w[k]));
    if (k < qp.horizon())
      grow(residual.dynamics, dynamics_defect(stage, w[k], w[k + 1].head(qp.stages[k + 1].nx)));
  }
  return residual;
}

}  // namespace palanquin
