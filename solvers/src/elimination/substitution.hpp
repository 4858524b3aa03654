#pragma once

#include <Eigen/Core>
#include <vector>

#include "palanquin/core/gather.hpp"
#include "palanquin/core/stage_qp.hpp"

namespace palanquin {

/// A knot without the inputs and locals that an equality row each gives: row i over variable j, and
/// no other row over j, says
///
///   w_j = t_j + sum_c s_c w_c,    t_j = -e_i / C_ij,  s_c = -C_ic / C_ij.
///
/// With the variables w' that stay, w = T w' + t, and H' = T'H T, J' = J T and so on: sums of
/// products of entries, whose places are found once per pattern. Knots of one pattern share them;
/// s and t are each one's own.
class Substitution {
 public:
  struct Values {
    std::vector<double> slopes;                        ///< all s_c
    bool is_shifted = false;                           ///< whether t is not zero
    Eigen::VectorXd shift, gradient, equality_values;  ///< t, g + H t, e
    Eigen::VectorXd penalty_shift;                     ///< J t of the penalised rows, if shifted
  };

  /// Chooses rows and variables, by the values of `stage` where there is a choice. `refused`, one
  /// flag a row, says which rows' pivots are too small, here or at another knot of the pattern.
  Substitution(const QpStage& stage, const std::vector<char>& refused);
  bool is_empty() const { return given_.empty(); }
  /// Whether all pivots are large enough for the values of `stage`; else says which rows' are not.
  bool holds(const QpStage& stage, std::vector<char>& refused) const;
  /// Dimensions and patterns.
  const QpStage& pattern() const { return pattern_; }
  Values make_values() const;
  void write(const QpStage& stage, Values& values, QpStage& reduced) const;

  /// w' of w, and back.
  void restrict_variables(const Eigen::VectorXd& w, Eigen::VectorXd& reduced) const;
  void extend_variables(const Values& values, const Eigen::VectorXd& reduced,
                        Eigen::VectorXd& w) const;
  /// Multipliers of the rows that stay; and back, zero for the others.
  void restrict_multipliers(const Eigen::VectorXd& mu, Eigen::VectorXd& reduced) const;
  void extend_multipliers(const Eigen::VectorXd& reduced, Eigen::VectorXd& mu) const;
  /// The others' multipliers become right where the Lagrangian's `gradient` [nw] has them wrong.
  void find_multipliers(const QpStage& stage, const Eigen::Ref<const Eigen::VectorXd>& gradient,
                        Eigen::VectorXd& mu) const;
  /// du/dx [nu x nx], from that of the inputs that stay.
  void extend_gain(const Values& values, const Eigen::MatrixXd& reduced,
                   Eigen::Ref<Eigen::MatrixXd> gain) const;

  struct Part {
    int column;  ///< of w'
    int slope;   ///< negative: 1
  };
  /// What variable j is made of.
  const Part* begin(int j) const { return parts_.data() + start_[index(j)]; }
  const Part* end(int j) const { return parts_.data() + start_[index(j + 1)]; }

 private:
  struct Given {
    int row = 0, column = 0, pivot = 0;       ///< the last one an entry of C
    int first = 0, size = 0;                  ///< its slopes
    int first_curvature = 0, curvatures = 0;  ///< its column of H
  };
  static std::size_t index(int i) { return static_cast<std::size_t>(i); }
  void list_rows(const SparseBlock& block);
  void give(const QpStage& stage, int row);
  void number_columns(const QpStage& stage);
  void list_curvatures(const SparseBlock& hessian);
  void shape(const QpStage& stage, QpStage& reduced);
  void shift(const QpStage& stage, Values& values, QpStage& reduced) const;
  void shape_rows(const SparseBlock& block, SparseBlock& reduced, Gather& gather) const;

  std::vector<std::vector<int>> row_entries_, row_columns_;  ///< of C
  std::vector<int> rows_over_;                               ///< [nw] rows of C over a variable
  std::vector<Given> given_;
  std::vector<int> given_by_;  ///< [nw] place in given_, or -1
  std::vector<int> kept_columns_, kept_rows_;
  std::vector<int> start_;  ///< [nw + 1]
  std::vector<Part> parts_;
  std::vector<int> slope_entry_, slope_column_;       ///< of C
  std::vector<int> curvature_row_, curvature_entry_;  ///< of H
  int nx_ = 0, nu_ = 0;                               ///< of the whole knot
  int kept_nu_ = 0;
  Gather dynamics_, hessian_, gradient_, penalty_, inequality_, equality_;
  QpStage pattern_;
};

}  // namespace palanquin
