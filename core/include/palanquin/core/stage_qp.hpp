#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

#include "palanquin/core/penalty.hpp"
#include "palanquin/core/sparse_block.hpp"

namespace palanquin {

/// One knot of a StageQp. Its variables are w = (x, u, l): `nx` states, `nu` inputs, `nl` locals.
/// A local meets only this knot's cost and rows: its columns of `dynamics` are empty.
struct QpStage {
  int nx = 0;
  int nu = 0;
  int nl = 0;
  /// Equal non-negative ids, in whatever StageQp of the process, mean equal dimensions and
  /// patterns, so that a back end may share its analysis between knots and solves; -1 promises
  /// nothing.
  int pattern = -1;
  int nw() const { return nx + nu + nl; }

  /// Dynamics to the next knot (empty at the last): (I - implicit) x_{k+1} = dynamics w_k + offset.
  SparseBlock dynamics;    ///< [nx_{k+1} x nw]
  SparseBlock implicit;    ///< [nx_{k+1} x nx_{k+1}], nilpotent: no chain of entries closes
  Eigen::VectorXd offset;  ///< [nx_{k+1}]

  /// Cost 1/2 w'Hw + g'w. Positive semidefinite in w, positive definite in (u, l).
  SparseBlock hessian;       ///< [nw x nw], lower triangle with the whole diagonal
  Eigen::VectorXd gradient;  ///< [nw]

  /// Penalised rows: sum_j S_j(penalty_value_j + (penalty_jacobian w)_j).
  SparseBlock penalty_jacobian;        ///< [np x nw]
  Eigen::VectorXd penalty_value;       ///< [np]
  std::vector<Policy> penalty_policy;  ///< [np], none of them hard

  /// Equality rows: equality_jacobian w + equality_value = 0.
  SparseBlock equality_jacobian;   ///< [ne x nw]
  Eigen::VectorXd equality_value;  ///< [ne]

  /// Hard inequality rows: inequality_jacobian w + inequality_value <= 0.
  SparseBlock inequality_jacobian;   ///< [ni x nw]
  Eigen::VectorXd inequality_value;  ///< [ni]

  /// Rows over the previous knot and this one (none at the first):
  /// link_previous w_{k-1} + link_jacobian w_k + link_value = 0.
  SparseBlock link_previous;   ///< [nc x nw_{k-1}]
  SparseBlock link_jacobian;   ///< [nc x nw]
  Eigen::VectorXd link_value;  ///< [nc]
};

/// An id for QpStage::pattern that nobody in the process has had. Any thread.
int new_pattern();

/// The stage-structured quadratic program with penalties that every SQP step solves:
///
///   min   sum_{k=0}^{N} 1/2 w_k'H_k w_k + g_k'w_k + sum_j S_kj(h_kj + J_kj w_k)
///   s.t.  x_0 = initial_state
///         (I - N_k) x_{k+1} = F_k w_k + b_k                    k = 0..N-1
///         C_k w_k + e_k = 0,   D_k w_k + d_k <= 0              k = 0..N
///         P_k w_{k-1} + E_k w_k + c_k = 0                      k = 1..N
///
/// with w_k = (x_k, u_k, l_k) and dimensions that may change from knot to knot. All quantities are
/// steps in the tangent space of the current iterate.
///
/// Owned by the linearisation, lent to the QP back ends. `structure_revision` changes whenever a
/// dimension or a sparsity pattern does, so that a back end knows when to analyse anew.
struct StageQp {
  std::vector<QpStage> stages;    ///< [N + 1]
  Eigen::VectorXd initial_state;  ///< [nx_0]
  std::uint64_t structure_revision = 0;

  int horizon() const { return static_cast<int>(stages.size()) - 1; }
  bool has_hard_rows() const;
};

/// Vectors that no knot has now. A gait that moves along the horizon brings sizes back, and so what
/// was allocated for them.
class SpareVectors {
 public:
  /// Gives every vector of `list` whose size is not the one asked for one of that size, zero.
  template <typename SizeOf>
  void resize(std::vector<Eigen::VectorXd>& list, std::size_t count, SizeOf size_of) {
    list.resize(count);
    for (std::size_t k = 0; k < count; ++k)
      if (list[k].size() > 0 && list[k].size() != size_of(k))
        vectors_.push_back(std::move(list[k]));
    for (std::size_t k = 0; k < count; ++k)
      if (list[k].size() != size_of(k)) list[k] = take(size_of(k));
  }

 private:
  Eigen::VectorXd take(Eigen::Index size);

  std::vector<Eigen::VectorXd> vectors_;
};

/// A primal-dual point of a StageQp. Multipliers follow the Lagrangian
///   L = cost + sum_k lambda_{k+1}'(F_k w_k + b_k - (I - N_k) x_{k+1}) + mu_k'(C_k w_k + e_k)
///            + nu_k'(D_k w_k + d_k) + sigma_k'(P_k w_{k-1} + E_k w_k + c_k)
///            + lambda_0'(initial_state - x_0).
struct StageQpSolution {
  std::vector<Eigen::VectorXd> w;                    ///< [N + 1], each [nw_k]
  std::vector<Eigen::VectorXd> dynamics_multiplier;  ///< [N + 1], entry k for x_k; entry 0 for x_0
  std::vector<Eigen::VectorXd> equality_multiplier;  ///< [N + 1]
  std::vector<Eigen::VectorXd> inequality_multiplier;  ///< [N + 1]
  std::vector<Eigen::VectorXd> link_multiplier;        ///< [N + 1]

  SpareVectors spare;

  /// Sizes every vector for `qp`; where a size differs all entries are zero. Allocates only what no
  /// QP before asked for.
  void resize(const StageQp& qp);
};

/// The penalties of a StageQp replaced by a quadratic each: row j adds
/// slope_j t + 1/2 curvature_j t^2 with t = (penalty_jacobian w)_j.
struct PenaltyModel {
  std::vector<Eigen::VectorXd> slope;      ///< [N + 1], each [np_k]
  std::vector<Eigen::VectorXd> curvature;  ///< [N + 1], each [np_k], >= 0
  SpareVectors spare;

  /// As StageQpSolution::resize.
  void resize(const StageQp& qp);
  /// The second-order expansion of every penalty about the point `w`.
  void expand(const StageQp& qp, const std::vector<Eigen::VectorXd>& w);
};

/// Cost of the StageQp at `w`, penalties exact. Equality and hard rows are not looked at.
double evaluate_cost(const StageQp& qp, const std::vector<Eigen::VectorXd>& w);

/// Gradient [nw_k] of the Lagrangian of StageQpSolution with respect to w_k, penalties as in
/// `model`. `rows` [np_k] is scratch.
void lagrangian_gradient(const StageQp& qp, const PenaltyModel& model,
                         const StageQpSolution& solution, int k,
                         Eigen::Ref<Eigen::VectorXd> gradient, Eigen::Ref<Eigen::VectorXd> rows);

/// Largest residual of the KKT conditions of the equality-constrained QP that `model` makes of
/// `qp`: stationarity, dynamics, equality and link rows. The certificate that tests use.
struct KktResidual {
  double stationarity = 0.0;
  double dynamics = 0.0;
  double equality = 0.0;
  double max() const;
};
KktResidual kkt_residual(const StageQp& qp, const PenaltyModel& model,
                         const StageQpSolution& solution);

}  // namespace palanquin
