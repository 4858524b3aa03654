#pragma once

#include <Eigen/Core>
#include <vector>

#include "palanquin/solvers/dense_qp_factors.hpp"
#include "palanquin/solvers/status.hpp"

namespace palanquin {

/// A small convex QP,
///
///   min 1/2 x'H x + g'x   s.t.   a_i'x  = b_i   for the first `equalities` rows of A,
///                                a_i'x >= b_i   for the others.
struct DenseQp {
  Eigen::MatrixXd H;  ///< [n, n], positive semidefinite; the lower triangle is read
  Eigen::VectorXd g;  ///< [n]
  Eigen::MatrixXd A;  ///< [m, n]
  Eigen::VectorXd b;  ///< [m]
  int equalities = 0;
};

/// Solves it by the dual active-set method of Goldfarb and Idnani (Mathematical Programming 27,
/// 1983): from the unconstrained minimiser, the most violated row is added to the active set, and
/// rows whose multiplier would change sign are dropped on the way. It costs one Cholesky
/// factorisation when no inequality is active. For some tens of variables; a repeated solve of the
/// same size allocates nothing.
///
/// A semidefinite H is made definite by a proximal term, 1/2 (x - c)'E (x - c), whose centre c
/// moves to the last solution until the KKT conditions of the QP itself hold (the proximal-point
/// method, as Arnstrom, Bemporad and Axehill use it in DAQP, IEEE TAC 67, 2022). With E = 0 the
/// same step is one of iterative refinement.
class DenseQpSolver {
 public:
  /// Converged: the KKT residuals were computed and are small: of stationarity, at most 1e-9 (1 +
  /// the largest of |Hx|, |g|, |A'y|); of a row, at most 1e-7 |a| + 1e-9 (|a| |x| + |b|).
  /// Infeasible: rows contradict each other by more than that, with a combination of them as proof.
  /// NonFinite: data that are not finite, or an H that is not positive semidefinite.
  /// IterationLimit: 20 (n + m) changes of the active set. QpFailed: the residuals do not get
  /// small, which an unbounded problem causes too. After anything but Converged the solution is not
  /// to be used.
  /// @throws std::invalid_argument when sizes do not fit
  Status solve(const DenseQp& qp);

  const Eigen::VectorXd& solution() const { return x_; }
  /// [m]: H x + g = A' multipliers; not negative for inequalities, 0 for inactive rows.
  const Eigen::VectorXd& multipliers() const { return multipliers_; }
  int changes() const { return changes_; }  ///< of the active set, in the last solve

 private:
  enum class Row : char {
    Inactive,
    Active,
    Dependent,  ///< on the active ones, which hold it as well as rounding allows: not to be chosen
  };

  void resize(const DenseQp& qp);
  bool factorize(const DenseQp& qp, bool is_proximal);
  Status start(const DenseQp& qp);
  Status run(const DenseQp& qp, int rounds);
  Status settle(const DenseQp& qp);
  void measure_rows(const DenseQp& qp);
  double tolerance(const DenseQp& qp, int row, double absolute, double relative) const;
  int most_violated(const DenseQp& qp);
  Status add_row(const DenseQp& qp, int row);
  bool contradicts(const DenseQp& qp, int row, double sign, double violation);
  bool has_drifted(const DenseQp& qp);
  void recentre(const DenseQp& qp);
  void restore(const DenseQp& qp);
  void correct(const DenseQp& qp);
  int most_negative() const;
  void drop(int position);
  void write_multipliers();
  bool is_optimal(const DenseQp& qp);

  DenseQpFactors factors_;
  Eigen::VectorXd x_, centre_, proximal_, multipliers_;
  Eigen::VectorXd norm_, slack_, normal_, d_, z_, r_, u_, residual_, step_;
  std::vector<int> active_;
  std::vector<double> sign_;  ///< -1 for an active equality that was reached from above
  std::vector<Row> rows_;
  double size_ = 0;  ///< |x|, the largest entry
  bool is_measured_ = false;
  int equalities_ = 0, changes_ = 0, limit_ = 0;
};

}  // namespace palanquin
