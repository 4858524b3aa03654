#pragma once

#include <Eigen/Core>
#include <vector>

#include "hard_rows/relaxed_qp.hpp"
#include "palanquin/solvers/qp_settings.hpp"
#include "palanquin/solvers/qp_structured.hpp"

namespace palanquin {

/// The method of multipliers with semismooth Newton steps (Li, Sun and Toh 2018; Bambade et al.
/// 2022): exact, and with a good active set one Riccati recursion. Row j of the hard ones adds
///
///   (max(0, nu_j + rho_j h_j)^2 - nu_j^2) / (2 rho_j)
///
/// with an estimate nu of its multiplier and a stiffness rho.
///
///   1. Minimise that. On an active set, the rows where nu_j + rho_j h_j > 0, it is a QP without
///      hard rows; its minimiser gives the next active set, until the set stays. From where the
///      rows that change do not get fewer an exact line search shortens the steps.
///   2. nu = max(0, nu + rho h). If the rows hold to the tolerance, done; if the update proves that
///      they contradict each other, infeasible; if they hardly improved, rho grows.
class MultiplierMethod {
 public:
  MultiplierMethod(const MultipliersSettings& settings, StructuredQpSolver& solver, RelaxedQp& qp)
      : settings_(settings), solver_(solver), qp_(qp) {}

  /// At most `recursions` of them, from point.inequality_multiplier. Solved; PrimalInfeasible,
  /// where the point violates the rows least; NotSolved when they were not enough; or what the
  /// solver answered.
  QpStatus run(StageQpSolution& point, int recursions);
  int recursions() const { return recursions_; }  ///< taken in the last run
  /// max_j |h_j| over active rows and max(h_j, 0) over the others at the last run's point; NaN if a
  /// row is.
  double violation() const;
  double update_ms() const { return update_ms_; }

 private:
  void start(const StageQpSolution& point);
  QpStatus take_newton_step(StageQpSolution& point);
  double search();
  int update_active_set();
  void restart_search();
  void watch_progress(int changes);
  void update_multipliers();
  bool is_contradiction(const StageQpSolution& point);

  const MultipliersSettings& settings_;
  StructuredQpSolver& solver_;
  RelaxedQp& qp_;
  StageQpSolution target_;
  std::vector<Eigen::VectorXd> direction_, last_;  ///< [nw] per knot; last_: of the last update
  // Over rows.
  Eigen::VectorXd multiplier_, stiffness_, outwards_, value_, change_, base_, curvature_, increase_;
  std::vector<char> is_active_;
  std::vector<Eigen::Index> misjudged_;  ///< rows that the model of a step has wrongly on or off
  bool has_last_ = false, is_searching_ = false;
  int fewest_changes_ = 0, stalled_ = 0;
  int recursions_ = 0;
  double update_ms_ = 0.0;
};

}  // namespace palanquin
