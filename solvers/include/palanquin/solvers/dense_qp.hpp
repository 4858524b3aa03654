#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

#include "palanquin/solvers/status.hpp"

namespace palanquin {

/// A small strictly convex QP,
///
///   min 1/2 x'H x + g'x   s.t.   a_i'x  = b_i   for the first `equalities` rows of A,
///                                a_i'x >= b_i   for the others.
struct DenseQp {
  Eigen::MatrixXd H;  ///< [n, n], positive definite; the lower triangle is read
  Eigen::VectorXd g;  ///< [n]
  Eigen::MatrixXd A;  ///< [m, n]
  Eigen::VectorXd b;  ///< [m]
  int equalities = 0;
};

/// Solves it by the dual active-set method of Goldfarb and Idnani (Mathematical Programming 27,
/// 1983): from the unconstrained minimiser, the most violated row is added to the active set, and
/// rows whose multiplier would change sign are dropped on the way; it ends after finitely many
/// steps, and costs one Cholesky factorisation when no inequality is active. For some tens of
/// variables; a repeated solve of the same size allocates nothing.
class DenseQpSolver {
 public:
  /// Converged; Infeasible when rows contradict each other; NonFinite for data that are not finite
  /// or an H that is not positive definite; IterationLimit after 10 (n + m) changes of the active
  /// set (rounding). After anything but Converged the solution is not to be used.
  Status solve(const DenseQp& qp);

  const Eigen::VectorXd& solution() const { return x_; }
  /// [m]: H x + g = A' multipliers; not negative for inequalities, 0 for inactive rows.
  const Eigen::VectorXd& multipliers() const { return multipliers_; }
  int changes() const { return changes_; }  ///< of the active set, in the last solve

 private:
  void resize(Eigen::Index n, Eigen::Index m);
  bool factorize(const DenseQp& qp);
  int most_violated(const DenseQp& qp) const;
  Status add_row(const DenseQp& qp, int row);
  void append(int row, double multiplier);
  void drop(int position);

  Eigen::LLT<Eigen::MatrixXd> cholesky_;  ///< H = L L'
  Eigen::MatrixXd J_, R_;                 ///< J = L^-T Q, and J'N = [R; 0] for the active rows N'
  Eigen::VectorXd x_, multipliers_, scale_, d_, z_, r_, u_;
  std::vector<int> active_;
  std::vector<double> sign_;  ///< -1 for an active equality that was reached from above
  std::vector<char> is_active_;
  int equalities_ = 0, changes_ = 0, limit_ = 0;
};

}  // namespace palanquin
