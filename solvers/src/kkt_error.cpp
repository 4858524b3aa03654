#include "palanquin/solvers/kkt_error.hpp"

#include <algorithm>
#include <cmath>

namespace palanquin {

namespace {
double largest(const Eigen::Ref<const Eigen::VectorXd>& v) {
  return v.size() > 0 ? v.lpNorm<Eigen::Infinity>() : 0.0;
}
}  // namespace

/// Starts gradient_, [nw] of it, with g + J'S'(h); returns its largest entry.
double KktErrorEvaluator::add_cost_gradient(const QpStage& stage) {
  // Knots differ in size: what has grown to the largest does not allocate again.
  if (gradient_.size() < stage.nw()) gradient_.resize(stage.nw());
  if (rows_.size() < stage.penalty_value.size()) rows_.resize(stage.penalty_value.size());
  gradient_.head(stage.nw()) = stage.gradient;
  for (Eigen::Index j = 0; j < stage.penalty_value.size(); ++j)
    rows_[j] =
        evaluate_penalty(stage.penalty_policy[static_cast<std::size_t>(j)], stage.penalty_value[j])
            .slope;
  stage.penalty_jacobian.multiply_transposed_add(rows_.data(), gradient_.data());
  return largest(gradient_.head(stage.nw()));
}

KktError KktErrorEvaluator::evaluate(const StageQp& qp, const StageQpSolution& s) {
  KktError error;
  double scale = 1.0;
  for (int k = 0; k <= qp.horizon(); ++k) {
    const QpStage& stage = qp.stages[k];
    scale = std::max(scale, add_cost_gradient(stage));
    double* r = gradient_.data();
    stage.equality_jacobian.multiply_transposed_add(s.equality_multiplier[k].data(), r);
    stage.inequality_jacobian.multiply_transposed_add(s.inequality_multiplier[k].data(), r);
    stage.link_jacobian.multiply_transposed_add(s.link_multiplier[k].data(), r);
    if (k > 0) {
      const Eigen::VectorXd& lambda = s.dynamics_multiplier[k];
      gradient_.head(stage.nx) -= lambda;
      qp.stages[k - 1].implicit.multiply_transposed_add(lambda.data(), r);
    }
    if (k < qp.horizon()) {
      stage.dynamics.multiply_transposed_add(s.dynamics_multiplier[k + 1].data(), r);
      qp.stages[k + 1].link_previous.multiply_transposed_add(s.link_multiplier[k + 1].data(), r);
    }
    // x_0 is given: nothing is to be gained along it.
    const Eigen::Index given = k == 0 ? stage.nx : 0;
    const double residual = largest(gradient_.segment(given, stage.nw() - given));
    if (!(residual <= error.stationarity)) error.stationarity = residual;  // NaN stays
    const Eigen::VectorXd& nu = s.inequality_multiplier[k];
    for (Eigen::Index j = 0; j < nu.size(); ++j)
      error.complementarity =
          std::max({error.complementarity, std::abs(nu[j] * stage.inequality_value[j]), -nu[j]});
  }
  error.stationarity /= scale;
  error.complementarity /= scale;
  return error;
}

double multiplier_norm(const StageQpSolution& s) {
  double squared = 0.0;
  for (std::size_t k = 0; k < s.w.size(); ++k)
    squared += (k > 0 ? s.dynamics_multiplier[k].squaredNorm() : 0.0) +
               s.equality_multiplier[k].squaredNorm() + s.inequality_multiplier[k].squaredNorm() +
               s.link_multiplier[k].squaredNorm();
  return std::sqrt(squared);
}

}  // namespace palanquin
