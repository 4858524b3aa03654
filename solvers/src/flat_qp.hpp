#pragma once

#include <Eigen/Core>
#include <vector>

#include "palanquin/core/stage_qp.hpp"

namespace palanquin {

/// A StageQp with its PenaltyModel as one sparse QP, for back ends that know nothing of stages:
///
///   min 1/2 z'Pz + q'z   s.t.   A z = r,  or A z <= r for the rows marked as inequalities.
///
/// z stacks w_0 without x_0, which is known and moves to q and r, then w_1 .. w_N. The rows of
/// knot k are its link rows, equality rows, hard inequality rows, and the dynamics to knot k+1 as
/// (I - N_k) x_{k+1} - F_k w_k = b_k, so that a column of A is a stack of columns of stage blocks.
///
/// P contains the full pattern of J'J of the penalised rows, active or not: both patterns depend
/// on the structure of the StageQp alone. `update` writes values through maps made by `analyse`
/// and does not allocate.
class FlatQp {
 public:
  /// Builds patterns and maps. Throws std::invalid_argument where sizes contradict each other.
  void analyse(const StageQp& qp);
  /// Rewrites all values; `qp` has the structure last analysed.
  void update(const StageQp& qp, const PenaltyModel& model);
  /// Rewrites what depends on qp.initial_state, when since `update` nothing else has changed.
  void update_initial_state(const StageQp& qp, const PenaltyModel& model);

  int variables() const { return hessian.cols; }
  int rows() const { return constraints.rows; }
  /// False when a value that a solver would see is infinite or NaN.
  bool is_finite() const;

  /// Copies a solution into z and the multipliers y of L = cost + y'(Az - r).
  void pack(const StageQpSolution& solution, double* z, double* y) const;
  /// The reverse. The multiplier of x_0 follows from stationarity.
  void unpack(const StageQp& qp, const PenaltyModel& model, const double* z, const double* y,
              StageQpSolution& solution);

  SparseBlock hessian;              ///< P [n x n], upper triangle with the whole diagonal
  Eigen::VectorXd gradient;         ///< q [n]
  SparseBlock constraints;          ///< A [m x n]
  Eigen::VectorXd right_side;       ///< r [m]
  std::vector<char> is_inequality;  ///< [m]

 private:
  /// Where the blocks of one knot go. Every map lists positions in the target's values, in the
  /// order of the source's values from its first free column on.
  struct StageMap {
    int first_variable = 0;  ///< of the knot's free columns in z
    int fixed_columns = 0;   ///< leading columns that are not variables: nx_0 at knot 0, else 0
    int link_row = 0, equality_row = 0, inequality_row = 0, dynamics_row = 0;

    std::vector<int> hessian;
    std::vector<int> link, equality, inequality, dynamics;
    std::vector<int> implicit;       ///< of the dynamics into this knot
    std::vector<int> link_previous;  ///< of the next knot's link rows

    // Penalised row j has the entries row_start[j] .. row_start[j+1]-1, each with its position in
    // penalty_jacobian.values and its variable. Their products (b, a), b <= a, go to the positions
    // of P listed in `pairs` from pair_start[j] on.
    std::vector<int> row_start, entry_position, entry_variable;
    std::vector<int> pair_start, pairs;
  };

  void number_rows_and_variables(const StageQp& qp);
  void list_penalty_entries(const QpStage& stage, StageMap& map);
  void build_hessian(const QpStage& stage, StageMap& map);
  void build_constraints(const StageQp& qp, int k);

  void add_curvatures(const QpStage& stage, const StageMap& map, const Eigen::VectorXd& curvature);
  void add_slopes(const QpStage& stage, const StageMap& map, const Eigen::VectorXd& slope);
  void update_constraints(const StageQp& qp, int k);
  void update_right_side(const StageQp& qp, int k);

  std::vector<StageMap> maps_;
  std::vector<double> penalty_row_;  ///< scratch: the entries of one penalised row
  // Scratch of knot 0, whose state is no variable:
  Eigen::VectorXd fixed_w_;   ///< x_0 at its value, zeros elsewhere
  Eigen::VectorXd gradient_;  ///< [nw_0]
  Eigen::VectorXd slope_;     ///< [np_0]
};

}  // namespace palanquin
