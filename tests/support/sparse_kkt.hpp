#pragma once

#include <Eigen/SparseCore>
#include <Eigen/SparseLU>
#include <vector>

#include "palanquin/core/stage_qp.hpp"

namespace palanquin::testing {

/// Solves the QP that `model` makes of `qp` by one sparse LU of its whole KKT matrix: initial
/// state, dynamics and equality rows; no structure used. The yardstick for structured back ends.
inline StageQpSolution solve_kkt_by_lu(const StageQp& qp, const PenaltyModel& model) {
  const int knots = qp.horizon() + 1;
  std::vector<int> w(knots), lambda(knots), mu(knots);  // where each knot's unknowns begin
  int size = 0;
  for (int k = 0; k < knots; ++k) w[k] = size, size += qp.stages[k].nw();
  for (int k = 0; k < knots; ++k) lambda[k] = size, size += qp.stages[k].nx;
  for (int k = 0; k < knots; ++k) mu[k] = size, size += qp.stages[k].equality_jacobian.rows;

  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd rhs = Eigen::VectorXd::Zero(size);
  const auto add = [&](int i, int j, double value) { entries.emplace_back(i, j, value); };
  const auto add_constraint = [&](int row, int column, const Eigen::MatrixXd& block) {
    for (int j = 0; j < block.cols(); ++j)
      for (int i = 0; i < block.rows(); ++i) {
        add(row + i, column + j, block(i, j));
        add(column + j, row + i, block(i, j));
      }
  };
  for (int k = 0; k < knots; ++k) {
    const QpStage& stage = qp.stages[k];
    const Eigen::MatrixXd lower = stage.hessian.dense();
    Eigen::MatrixXd h = lower.selfadjointView<Eigen::Lower>();
    Eigen::VectorXd g = stage.gradient;
    if (stage.penalty_jacobian.rows > 0) {
      const Eigen::MatrixXd jacobian = stage.penalty_jacobian.dense();
      h += jacobian.transpose() * model.curvature[k].asDiagonal() * jacobian;
      g += jacobian.transpose() * model.slope[k];
    }
    for (int j = 0; j < h.cols(); ++j)
      for (int i = 0; i < h.rows(); ++i) add(w[k] + i, w[k] + j, h(i, j));
    rhs.segment(w[k], stage.nw()) = -g;

    const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(stage.nx, stage.nx);
    if (k == 0) {
      add_constraint(lambda[0], w[0], -identity);
      rhs.segment(lambda[0], stage.nx) = -qp.initial_state;
    } else {
      const QpStage& before = qp.stages[k - 1];
      add_constraint(lambda[k], w[k - 1], before.dynamics.dense());
      add_constraint(lambda[k], w[k], before.implicit.dense() - identity);
      rhs.segment(lambda[k], stage.nx) = -before.offset;
    }
    if (stage.equality_jacobian.rows > 0) {
      add_constraint(mu[k], w[k], stage.equality_jacobian.dense());
      rhs.segment(mu[k], stage.equality_jacobian.rows) = -stage.equality_value;
    }
  }
  Eigen::SparseMatrix<double> kkt(size, size);
  kkt.setFromTriplets(entries.begin(), entries.end());
  kkt.prune(0.0);
  Eigen::SparseLU<Eigen::SparseMatrix<double>> lu(kkt);
  Eigen::VectorXd unknowns = lu.solve(rhs);
  unknowns += lu.solve(rhs - kkt * unknowns);

  StageQpSolution solution;
  solution.resize(qp);
  for (int k = 0; k < knots; ++k) {
    solution.w[k] = unknowns.segment(w[k], qp.stages[k].nw());
    solution.dynamics_multiplier[k] = unknowns.segment(lambda[k], qp.stages[k].nx);
    solution.equality_multiplier[k] = unknowns.segment(mu[k], qp.stages[k].equality_jacobian.rows);
  }
  return solution;
}

/// Largest difference over all knots, relative to the largest entry (at least 1).
inline double relative_difference(const std::vector<Eigen::VectorXd>& a,
                                  const std::vector<Eigen::VectorXd>& b) {
  double difference = 0.0, size = 1.0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    if (a[k].size() == 0) continue;
    difference = std::max(difference, (a[k] - b[k]).lpNorm<Eigen::Infinity>());
    size = std::max(size, b[k].lpNorm<Eigen::Infinity>());
  }
  return difference / size;
}

}  // namespace palanquin::testing
