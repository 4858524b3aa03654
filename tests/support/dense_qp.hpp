#pragma once

#include <Eigen/LU>
#include <vector>

#include "palanquin/core/stage_qp.hpp"

namespace palanquin::testing {

/// A StageQp with its PenaltyModel as dense matrices, written down straight from the definition:
///   min 1/2 z'Pz + q'z   s.t.   A z = r,      z = (w_0, .., w_N),
/// the initial state among the rows. Hard inequalities are left out.
struct DenseQp {
  Eigen::MatrixXd P, A;
  Eigen::VectorXd q, r;
  std::vector<int> first;  ///< of each knot in z

  DenseQp(const StageQp& qp, const PenaltyModel& model) {
    int variables = 0, rows = qp.stages[0].nx;
    for (const QpStage& s : qp.stages) {
      first.push_back(variables);
      variables += s.nw();
      rows += static_cast<int>(s.offset.size() + s.equality_value.size() + s.link_value.size());
    }
    P.setZero(variables, variables);
    q.setZero(variables);
    A.setZero(rows, variables);
    r.setZero(rows);

    const int nx = qp.stages[0].nx;
    A.topLeftCorner(nx, nx).setIdentity();
    r.head(nx) = qp.initial_state;
    int row = nx;
    for (int k = 0; k <= qp.horizon(); ++k) {
      const QpStage& s = qp.stages[k];
      const int i = first[k];
      const Eigen::MatrixXd lower = s.hessian.dense();
      const Eigen::MatrixXd j = s.penalty_jacobian.dense();
      P.block(i, i, s.nw(), s.nw()) = lower.selfadjointView<Eigen::Lower>();
      P.block(i, i, s.nw(), s.nw()) += j.transpose() * model.curvature[k].asDiagonal() * j;
      q.segment(i, s.nw()) = s.gradient + j.transpose() * model.slope[k];

      const auto ne = s.equality_value.size();
      A.block(row, i, ne, s.nw()) = s.equality_jacobian.dense();
      r.segment(row, ne) = -s.equality_value;
      row += static_cast<int>(ne);
      const auto nc = s.link_value.size();
      if (nc > 0) {
        A.block(row, i, nc, s.nw()) = s.link_jacobian.dense();
        A.block(row, first[k - 1], nc, qp.stages[k - 1].nw()) = s.link_previous.dense();
        r.segment(row, nc) = -s.link_value;
        row += static_cast<int>(nc);
      }
      if (k == qp.horizon()) break;
      const auto next = s.offset.size();
      A.block(row, first[k + 1], next, next).setIdentity();
      A.block(row, first[k + 1], next, next) -= s.implicit.dense();
      A.block(row, i, next, s.nw()) -= s.dynamics.dense();
      r.segment(row, next) = s.offset;
      row += static_cast<int>(next);
    }
  }

  /// The minimiser, from the whole KKT matrix by LU.
  Eigen::VectorXd solve() const {
    const auto n = P.rows(), m = A.rows();
    Eigen::MatrixXd kkt = Eigen::MatrixXd::Zero(n + m, n + m);
    kkt << P, A.transpose(), A, Eigen::MatrixXd::Zero(m, m);
    Eigen::VectorXd right(n + m);
    right << -q, r;
    return kkt.fullPivLu().solve(right).head(n);
  }

  static Eigen::VectorXd stack(const std::vector<Eigen::VectorXd>& w) {
    Eigen::VectorXd z(0);
    for (const Eigen::VectorXd& part : w) {
      z.conservativeResize(z.size() + part.size());
      z.tail(part.size()) = part;
    }
    return z;
  }
  std::vector<Eigen::VectorXd> split(const Eigen::VectorXd& z) const {
    std::vector<Eigen::VectorXd> w;
    for (std::size_t k = 0; k < first.size(); ++k) {
      const auto end = k + 1 < first.size() ? first[k + 1] : z.size();
      w.push_back(z.segment(first[k], end - first[k]));
    }
    return w;
  }
};

}  // namespace palanquin::testing
