#pragma once

#include <Eigen/Core>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "palanquin/core/stage_qp.hpp"
#include "palanquin/solvers/penalty_subproblem.hpp"
#include "palanquin/solvers/qp_settings.hpp"
#include "palanquin/solvers/qp_solver.hpp"

namespace palanquin {

/// Parameters of the restoration (docs/algorithms.md, section 4).
struct RestorationSettings {
  /// Weight of the proximal term beside the rows, relative; it grows while steps are refused.
  double proximal = 1e-6;
  /// The rows' violation is stationary, hence the problem infeasible, when a step would lower its
  /// square by less than this share.
  double certificate = 1e-6;
  /// A real-time step whose QP has no solution leaves the rows by as little as it can. False: such
  /// a step fails, as it should where the program is linear.
  bool elastic = true;

  /// An empty string, or a sentence that names field, value and rule.
  std::string explain_invalid() const;
};

/// A step towards the rows of a QP that has no solution, or whose steps are of no use:
///
///   min  kappa/2 (|C w + e|^2 + |max(0, D w + d)|^2) + rho/2 w'S w   [+ cost]
///   s.t. the linearised dynamics (and link rows)
///
/// a StageQp with penalties alone, which has a solution whatever the rows say: dynamics can always
/// be followed. S is the scale of Damping; kappa brings the longest row so far to the scale of S.
class Restoration {
 public:
  Restoration(const RestorationSettings& settings, const QpSettings& qp_settings);

  void reset();
  /// Solves it for the linearisation `qp` with the scale S [N + 1][nw_k]; writes the step into
  /// `step`, which has the sizes of `qp`. `with_cost` keeps the QP's cost, as the second objective
  /// after the rows (an elastic mode).
  QpStatus solve(const StageQp& qp, const std::vector<Eigen::VectorXd>& scale, bool with_cost,
                 StageQpSolution& step);
  /// A shorter step next time. False at the limit.
  bool shorten();
  /// After an accepted step.
  void lengthen();

  /// 2-norm of the rows' violation at the linearisation of the last `solve`.
  double violation() const { return violation_; }
  /// Whether the last step lowers the rows' violation to first order by next to nothing. Together
  /// with dynamics that hold it certifies that the problem is infeasible (locally, unless it is
  /// convex).
  bool is_stationary() const { return is_negligible(violation_, predicted_); }
  /// The same of a step that weighs the rows like the proximal term: near a point where the rows'
  /// derivatives vanish, longer steps promise what they do not hold.
  bool is_stationary_when_balanced(const StageQp& qp, const std::vector<Eigen::VectorXd>& scale);
  /// After the last `solve` for `qp`, where is_stationary(): multipliers of its rows that are the
  /// violations left, those of the dynamics that go with them, all divided by the violations' norm.
  StageQpSolution certificate(const StageQp& qp);
  /// A random step along the linearised dynamics and links, its largest entry 1; the same ones in
  /// every solve. False when there is none.
  bool random_step(const StageQp& qp, const std::vector<Eigen::VectorXd>& scale,
                   StageQpSolution& step);
  /// Whether a violation that falls from `before` to `after` hardly does.
  bool is_negligible(double before, double after) const;

 private:
  QpStatus solve(const StageQp& qp, const std::vector<Eigen::VectorXd>& scale, double proximal,
                 bool with_cost);
  void build(const StageQp& qp, const std::vector<Eigen::VectorXd>& scale, double proximal,
             bool with_cost);
  void choose_back_end(const StageQp& qp);

  RestorationSettings settings_;
  QpSettings qp_settings_;
  PenaltySubproblem subproblem_;
  std::unique_ptr<QpSolver> solver_;
  std::minstd_rand random_{1};
  StageQp relaxed_;
  StageQpSolution point_;
  double row_norm_ = 0.0;  ///< squared, of the longest row since `reset`
  double proximal_ = 0.0;
  double stiffness_ = 1.0;  ///< of the rows in `relaxed_`
  double violation_ = 0.0, predicted_ = 0.0;
};

}  // namespace palanquin
