#pragma once

#include <memory>
#include <string>

#include "palanquin/core/stage_qp.hpp"
#include "palanquin/solvers/kernel_level.hpp"
#include "palanquin/solvers/qp_solver.hpp"

namespace palanquin {

struct PenaltySubproblemSettings {
  int max_inner_iterations = 6;  ///< QPs per subproblem; 1 is the paper's one curvature a step
  double tolerance = 1e-8;       ///< on the penalties' slopes and on the decrease, relative
  /// Ends as well when another QP would lower the cost by less than this share of the decrease so
  /// far: the linearisation is not worth more. 0 for the exact minimiser.
  double decrease_tolerance = 1e-3;

  /// An empty string, or a sentence that names field, value and rule.
  std::string explain_invalid() const;
};

struct PenaltySubproblemResult {
  QpStatus status = QpStatus::NotSolved;
  int iterations = 0;      ///< QPs solved
  bool converged = false;  ///< the point minimises the true penalties, not only a model of them
  double predicted_change = 0.0;  ///< of the StageQp's cost, penalties exact, from the start
  double update_ms = 0.0;         ///< of the QP back end, summed over the iterations
  double solve_ms = 0.0;
};

/// Minimises a StageQp with its penalties as they are, by semismooth Newton: every penalty is
/// replaced by its quadratic at the current point, any QpSolver solves that, and an exact search
/// along the segment to its solution finds the next point.
///
/// With one curvature per SQP step, as in De Vincenti and Coros, rows that become active or
/// inactive within the step can make the SQP cycle between two points. The cost is convex and the
/// rows are linear: on the segment between two points that satisfy them all points do, and the
/// lowest one is found from phi' = 0. So the cost never rises, whatever the quadratics predict. It
/// can only do so where the start violates the rows: then the first step is taken in full.
///
/// Owns its workspace; allocates only when the QP's dimensions change.
class PenaltySubproblem {
 public:
  /// Throws std::invalid_argument if a setting breaks its rule, or if the processor lacks `level`.
  explicit PenaltySubproblem(const PenaltySubproblemSettings& settings = {},
                             KernelLevel level = KernelLevel::Automatic);
  ~PenaltySubproblem();

  /// Starts at `solution`, which has the sizes of `qp`, and leaves the best point there. When the
  /// status is not usable `solution` is unchanged.
  PenaltySubproblemResult solve(const StageQp& qp, QpSolver& solver, StageQpSolution& solution);

  /// As above, but the first QP uses the penalties of `first_model`, say those that were active in
  /// a similar subproblem.
  PenaltySubproblemResult solve(const StageQp& qp, QpSolver& solver,
                                const PenaltyModel& first_model, StageQpSolution& solution);

  /// `solve` from w = 0 in two phases, for a QP whose initial state is not known yet: `prepare`
  /// expands the penalties and lets `solver` prepare, `finish` solves. Between them nothing in `qp`
  /// but the initial state may change.
  QpStatus prepare(const StageQp& qp, QpSolver& solver, StageQpSolution& solution);
  PenaltySubproblemResult finish(const StageQp& qp, QpSolver& solver, StageQpSolution& solution);

  /// The penalties expanded about the last solution.
  const PenaltyModel& model() const { return model_; }

 private:
  PenaltySubproblemResult run(const StageQp& qp, QpSolver& solver, StageQpSolution& solution,
                              bool is_model_local, bool is_prepared);

  PenaltySubproblemSettings settings_;
  std::unique_ptr<class PenaltySegment> segment_;
  PenaltyModel model_;
  StageQpSolution candidate_;
  Eigen::VectorXd residual_;  ///< scratch for the rows of a knot
};

}  // namespace palanquin
