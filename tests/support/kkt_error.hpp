#pragma once

#include <algorithm>

#include "palanquin/solvers/dense_qp.hpp"

namespace palanquin::testing {

/// Largest violation of the KKT conditions of a dense QP by a point x with multipliers y.
inline double kkt_error(const DenseQp& qp, const Eigen::VectorXd& x, const Eigen::VectorXd& y) {
  const Eigen::MatrixXd H = qp.H.selfadjointView<Eigen::Lower>();
  const Eigen::VectorXd slack = qp.A * x - qp.b;
  const auto inequalities = qp.b.size() - qp.equalities;
  double error = (H * x + qp.g - qp.A.transpose() * y).lpNorm<Eigen::Infinity>();
  if (qp.equalities > 0)
    error = std::max(error, slack.head(qp.equalities).lpNorm<Eigen::Infinity>());
  if (inequalities > 0) {
    const auto s = slack.tail(inequalities).array(), u = y.tail(inequalities).array();
    error = std::max({error, -s.minCoeff(), -u.minCoeff(), (s * u).abs().maxCoeff()});
  }
  return error;
}

}  // namespace palanquin::testing
