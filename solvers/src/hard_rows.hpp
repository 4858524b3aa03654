#pragma once

#include <Eigen/Core>
#include <vector>

#include "palanquin/core/stage_qp.hpp"

namespace palanquin {

/// The hard inequality rows D w + d <= 0 of a StageQp as an augmented Lagrangian has them: row j
/// adds
///
///   (max(0, nu_j + rho_j h_j)^2 - nu_j^2) / (2 rho_j),   h = D w + d,
///
/// with an estimate nu of its multiplier and a stiffness rho. On an active set, the rows where
/// nu_j + rho_j h_j > 0, that is a quadratic: a penalised row of a StageQp without hard rows.
/// Nothing allocates while the QP's structure stays.
class HardRows {
 public:
  /// Takes over `qp`, its hard rows appended to the penalised ones, and the multipliers' estimates.
  /// `stiffness` is relative to the curvature of the variables that a row is over.
  void start(const StageQp& qp, const PenaltyModel& model, const StageQpSolution& warm,
             double stiffness);

  /// The QP without hard rows. Its penalised rows are those of the original, then the hard ones.
  const StageQp& relaxed() const { return relaxed_; }
  /// The quadratics of the active set, those of the original's penalties before them.
  const PenaltyModel& model();

  /// Puts the point at w.
  void evaluate(const std::vector<Eigen::VectorXd>& w);
  /// The step length in [0, 1] of lowest cost from `from` to `to`, where `to` minimises the model
  /// and the point is at `from`. Both satisfy the QP's equalities.
  double search(const std::vector<Eigen::VectorXd>& from, const std::vector<Eigen::VectorXd>& to);
  /// Replaces the active set by that of the point; false if they are the same.
  bool update_active_set();

  /// nu = max(0, nu + rho h); the first-order update of the method of multipliers.
  void update_multipliers();
  void multiply_stiffness(double factor) { stiffness_ *= factor; }
  void store_multipliers(StageQpSolution& solution) const;

  /// max_j |h_j| over active rows and max(h_j, 0) over the others; NaN if a row is.
  double violation() const;

 private:
  template <typename Visit>
  void for_each_knot(Visit&& visit) const;
  void append_rows(const QpStage& stage, QpStage& relaxed) const;
  void set_stiffness(const QpStage& stage, Eigen::Index first, double stiffness);
  double curvature_along();

  const StageQp* qp_ = nullptr;
  StageQp relaxed_;
  PenaltyModel model_;
  std::vector<Eigen::VectorXd> direction_;  ///< of the line search, [nw] per knot
  Eigen::VectorXd scratch_;                 ///< H d, or the change of a knot's penalised rows
  // Over all hard rows, knot by knot.
  Eigen::VectorXd multiplier_, stiffness_, value_, change_;
  std::vector<char> is_active_;
};

}  // namespace palanquin
