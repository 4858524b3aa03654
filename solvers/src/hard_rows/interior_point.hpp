#pragma once

#include <Eigen/Core>
#include <vector>

#include "hard_rows/relaxed_qp.hpp"
#include "palanquin/solvers/qp_settings.hpp"
#include "palanquin/solvers/qp_structured.hpp"

namespace palanquin {

/// Mehrotra's predictor-corrector (SIAM J. Optimization 2, 1992) on the Riccati recursion, with the
/// rows regularised as in a proximal method of multipliers (Schwan et al., PIQP, 2023): with slacks
/// s and multipliers nu of D w + d <= 0 a step to (w+, s+, nu+) solves
///
///   D w+ + d + s+ = delta (nu+ - nu),     nu s+ + s nu+ = s nu + c,
///
/// and the QP's stationarity, dynamics and equality rows. Eliminating s+ leaves RelaxedQp's forces
///
///   nu+ = nu + (c + nu h(w+)) / (s + delta nu),
///
/// whose curvatures stay below 1 / delta: what makes the recursion well conditioned next to stiff
/// equality rows. The predictor has c = 0, the corrector c = sigma mu - ds dnu.
///
/// Needs no warm start and hardly more steps for many changes of the active set than for few.
class InteriorPoint {
 public:
  InteriorPoint(StructuredQpSolver& solver, RelaxedQp& qp) : solver_(solver), qp_(qp) {}

  /// From cold: only the point's w counts, as a first guess of the slacks.
  void start(const StageQpSolution& point);
  /// Steps until the mean product of slacks and multipliers is `goal` of that at the start.
  /// Afterwards `point` is the last target. Solved, NotSolved when `iterations` of two recursions
  /// were not enough or steps get too short, or what the solver answered.
  QpStatus run(double goal, int iterations, StageQpSolution& point);
  /// nu where it outweighs the slack, 0 elsewhere: the active set that the run has found.
  void write_active_multipliers(StageQpSolution& point) const;
  int recursions() const { return recursions_; }  ///< taken in the last run
  double update_ms() const { return update_ms_; }

 private:
  QpStatus find_target();
  double longest_step() const;

  StructuredQpSolver& solver_;
  RelaxedQp& qp_;
  StageQpSolution target_;
  Eigen::VectorXd s_, nu_, delta_, c_;  // over rows
  Eigen::VectorXd h_, nu_target_, ds_, dnu_, denominator_, base_, curvature_;
  double mu_at_start_ = 0.0;
  int recursions_ = 0;
  double update_ms_ = 0.0;
};

}  // namespace palanquin
