#pragma once

#include <memory>
#include <string>
#include <vector>

#include "palanquin/core/stage_qp.hpp"
#include "palanquin/core/transcription/evaluation.hpp"
#include "palanquin/core/transcription/inputs.hpp"
#include "palanquin/core/transcription/knot_shape.hpp"
#include "palanquin/core/transcription/model.hpp"

namespace palanquin {

/// Where a lowered function first gave a value that is not finite.
struct NonFinite {
  bool found = false;
  std::string message;   ///< names function, row and knot
  std::string function;  ///< "running", "terminal_linear", ...; "guess" for a guess
  std::string what;      ///< row, block, "the cost", or the derivative of one of them
  int knot = -1;
};

/// What a solver lends to a TranscriptionModel while it solves: for given inputs it linearises a
/// trajectory into a StageQp, evaluates one, and moves one along a QP solution in the tangent
/// space.
///
/// Usage: set_parameters, set_measured, project, then linearize / evaluate / step as often as
/// needed. Once every combination of flags has been seen nothing allocates; combinations are kept
/// up to a bound. For one thread at a time; it uses `threads` threads inside.
class TranscriptionWorkspace {
 public:
  /// Throws std::invalid_argument for threads < 1.
  explicit TranscriptionWorkspace(std::shared_ptr<const TranscriptionModel> model, int threads = 1);
  ~TranscriptionWorkspace();

  const TranscriptionModel& model() const { return *model_; }
  std::shared_ptr<const TranscriptionModel> shared_model() const { return model_; }
  const LoweredProblem& problem() const { return model_->problem(); }
  int horizon() const { return model_->horizon(); }

  /// What was set last.
  const TranscriptionInputs& inputs() const { return inputs_; }
  /// How inequalities enter from now on.
  void set_policies(std::shared_ptr<const RowPolicies> policies);
  /// As TranscriptionInputs::set_parameters, and resolves roles; throws also for a role that does
  /// not exist, naming block and knot.
  void set_parameters(MatrixView parameters);
  /// As TranscriptionInputs::set_measured.
  void set_measured(VectorView measured);

  /// Makes `trajectory` [N + 1, nz] consistent with roles: fixed and carried blocks copied, absent
  /// ones zero, charted ones on their surface, quaternions of unit norm. x_0 is otherwise not
  /// touched. Throws std::invalid_argument for a wrong shape or a quaternion of norm zero.
  void project(RowMatrix& trajectory);
  /// Sets the states of x_0 to the measured ones, on the guess's side of every quaternion.
  void place_initial_state(RowMatrix& trajectory) const;

  /// Linearises all knots into qp(). Reports a value that is not finite; derivatives are left to
  /// find_non_finite_derivative() of the diagnosis, for when a QP back end could not work with
  /// them. The initial state of the QP is measured (-) x_0. Throws std::invalid_argument if the
  /// dynamics depend on a local block, whose derivatives the QP has no place for.
  NonFinite linearize(const RowMatrix& trajectory);
  /// Only the QP's initial state, for a state that was measured after linearize().
  void update_initial_state(const RowMatrix& trajectory);

  /// Replaces the Hessians that linearize() made at `trajectory` by those of the stages'
  /// Lagrangians with the given multipliers, penalties' slopes included; with `convexify` each is
  /// made positive semidefinite by CurvatureMirror. Curvature of link rows is left out. Call it on
  /// the heels of linearize(), with a model that has exact functions.
  void use_exact_hessians(const RowMatrix& trajectory, const StageQpSolution& multipliers,
                          bool convexify);

  /// Adds weight * scale [N + 1][nw_k] to the diagonals of the QP's Hessians, until the next
  /// linearize().
  void regularize(double weight, const std::vector<Eigen::VectorXd>& scale);

  Evaluation evaluate(const RowMatrix& trajectory);
  /// As evaluate(), of the trajectory that linearize() or evaluate() has just seen.
  Evaluation summarize() const;
  /// to = from (+) alpha * solution, charts applied.
  void step(const RowMatrix& from, const StageQpSolution& solution, double alpha, RowMatrix& to);

  const StageQp& qp() const;
  /// Slopes of the charts at a knot of the last linearize(), for ColumnMap::expand.
  const double* slopes(int knot) const;
  const KnotShape& shape(int knot) const;
  /// Of the trajectory that linearize() or evaluate() has just seen.
  const KnotValues& values(int knot) const;
  /// Combinations of flags that are kept, and shapes that follow from them.
  std::size_t kept() const;

 private:
  void resolve();
  void embed(RowMatrix& trajectory, int knot);

  struct Parts;
  std::shared_ptr<const TranscriptionModel> model_;
  TranscriptionInputs inputs_;
  std::unique_ptr<Parts> parts_;
};

}  // namespace palanquin
