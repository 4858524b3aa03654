#pragma once

#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "palanquin/core/exact_hessian.hpp"
#include "palanquin/core/knot_shape.hpp"
#include "palanquin/core/lowered_problem.hpp"
#include "palanquin/core/stage_qp.hpp"
#include "palanquin/core/thread_pool.hpp"
#include "palanquin/core/trajectory.hpp"

namespace palanquin {

/// Where a lowered function first gave a value that is not finite.
struct NonFinite {
  bool found = false;
  std::string message;  ///< names function, row and knot
};

/// Merit quantities of a trajectory.
struct Evaluation {
  double cost = 0.0;            ///< objective without penalties
  double penalty = 0.0;         ///< sum of all penalties
  double equality_max = 0.0;    ///< largest |residual| of dynamics, equality and link rows
  double infeasibility = 0.0;   ///< 2-norm of those residuals and of violated hard rows
  double inequality_max = 0.0;  ///< largest violation of a hard row
  bool is_finite = true;
  double total() const { return cost + penalty; }
};

/// A violated row, worst first in reports.
struct RowViolation {
  std::string name;
  double value = 0.0;  ///< in the row's own unit
};

/// The multiple-shooting transcription of a lowered problem over N intervals: for given parameters
/// and measured state it linearises a trajectory into a StageQp, evaluates one, and moves one along
/// a QP solution in the tangent space.
///
/// Usage: set_parameters, set_measured, project, then linearize / evaluate / step as often as
/// needed. Once every combination of flags has been seen nothing allocates. Not thread-safe itself;
/// it uses `threads` threads inside.
class Transcription {
 public:
  /// `exact` is needed by use_exact_hessians() alone. Inequality families begin with the policies
  /// that were stated with the problem. Throws std::invalid_argument for horizon < 1 or
  /// threads < 1, std::runtime_error when `exact` is of another problem.
  Transcription(std::shared_ptr<const LoweredProblem> problem, int horizon, Form form,
                int threads = 1, std::shared_ptr<const ExactHessian> exact = nullptr);
  ~Transcription();

  const LoweredProblem& problem() const { return *problem_; }
  int horizon() const { return horizon_; }
  Form form() const { return form_; }

  /// Sets the policy of a constraint family. Throws std::invalid_argument for an unknown family or
  /// invalid coefficients.
  void set_policy(const std::string& family, const Policy& policy);
  Policy policy(const std::string& family) const;

  /// Copies the parameters [N + 1, np] and resolves roles. Throws std::invalid_argument that names
  /// parameter or block and knot when a value is not finite or a role does not exist.
  void set_parameters(MatrixView parameters);

  /// Copies the measured knot vector [nz]: states at knot 0, other blocks' values before it.
  /// Throws std::invalid_argument for values that are not finite or quaternions of norm zero.
  void set_measured(VectorView measured);
  /// The measured knot with its quaternions normalised.
  const Eigen::VectorXd& measured() const { return measured_; }

  /// Makes `trajectory` [N + 1, nz] consistent with roles: fixed and carried blocks copied, absent
  /// ones zero, charted ones on their surface, quaternions of unit norm. x_0 is otherwise not
  /// touched. Throws std::invalid_argument for a wrong shape or a quaternion of norm zero.
  void project(RowMatrix& trajectory);
  /// Sets the states of x_0 to the measured ones, on the guess's side of every quaternion.
  void place_initial_state(RowMatrix& trajectory) const;

  /// Linearises all knots into qp(). Reports a value that is not finite; derivatives are left to
  /// find_non_finite(), for when a QP back end could not work with them. The initial state of the
  /// QP is measured (-) x_0. Throws std::invalid_argument if the dynamics depend on a local block,
  /// whose derivatives the QP has no place for.
  NonFinite linearize(const RowMatrix& trajectory);
  /// Where the last linearisation is not finite, derivatives included.
  NonFinite find_non_finite() const;
  /// Only the QP's initial state, for a state that was measured after linearize().
  void update_initial_state(const RowMatrix& trajectory);

  /// Replaces the Hessians that linearize() made at `trajectory` by those of the stages'
  /// Lagrangians with the given multipliers, penalties' slopes included, each made positive
  /// semidefinite by CurvatureMirror. Curvature of link rows is left out. Call it on the heels of
  /// linearize().
  void use_exact_hessians(const RowMatrix& trajectory, const StageQpSolution& multipliers);

  /// Adds `weight` to every diagonal entry of the QP's Hessians, until the next linearize().
  void regularize(double weight);

  Evaluation evaluate(const RowMatrix& trajectory);
  /// As evaluate(), of the trajectory that linearize() or evaluate() has just seen.
  Evaluation summarize() const;
  /// to = from (+) alpha * solution, charts applied.
  void step(const RowMatrix& from, const StageQpSolution& solution, double alpha, RowMatrix& to);

  const StageQp& qp() const { return qp_; }
  /// Slopes of the charts at a knot of the last linearize(), for ColumnMap::expand.
  const double* slopes(int knot) const;
  const KnotShape& shape(int knot) const { return *shapes_[static_cast<std::size_t>(knot)]; }

  /// Largest violation per inequality family, in physical units (RowGroup::scale).
  std::map<std::string, double> violations(const RowMatrix& trajectory);
  /// The `count` largest residuals of equality-type and violated inequality rows.
  std::vector<RowViolation> worst_rows(const RowMatrix& trajectory, int count);
  /// The three of them in words, for messages: "worst: friction (limb LF, row 2, knot 3) 0.2, ...".
  std::string describe_worst_rows(const RowMatrix& trajectory);

 private:
  struct KnotBuffers;  // results of the lowered functions at one knot
  struct ThreadBuffers;
  enum class KnotResult : int;
  struct ExactBuffers;
  class FlagTable;
  using Flags = std::vector<double>;  // results of the lowered function `structure`

  void read_flags();
  Role stated_role(int knot, std::size_t block) const;
  Role resolve_role(int knot, std::size_t block) const;
  const KnotSignature* resolve_signature(int knot);
  void resolve_shapes();
  void update_stages();
  void take_on(QpStage& stage, const KnotShape& shape);
  void evaluate_knots(const RowMatrix& trajectory, bool linear);
  void evaluate_group(int thread, int first, int last, const RowMatrix& trajectory,
                      const LaneFunction& function);
  static KnotResult terminal_result(int result);
  void take(int knot, KnotResult result, const double* values, int stride);
  void evaluate_chart(int thread, int knot, const RowMatrix& trajectory);
  void evaluate_link(int thread, int knot, const RowMatrix& trajectory, bool linear);
  void fill_values(int knot, const RowMatrix& trajectory);
  void refuse_locals_in_dynamics() const;
  void set_multipliers(int knot, const StageQpSolution& multipliers);
  void evaluate_exact_hessian(int thread, int knot, const RowMatrix& trajectory);
  void embed(RowMatrix& trajectory, int knot);
  void evaluate_defect(int knot, const RowMatrix& trajectory);
  bool has_finite_values(int knot) const;
  bool has_finite_derivatives(int knot) const;
  const double* parameters_at(int knot) const { return parameters_.row(knot).data(); }

  std::shared_ptr<const LoweredProblem> problem_;
  std::shared_ptr<const ExactHessian> exact_;
  int horizon_;
  Form form_;
  // Of running and terminal stages: per inequality row its policy and what follows from that, per
  // group whether it is hard.
  std::vector<Policy> policies_[2];
  std::vector<double> vanishes_until_[2];
  std::vector<char> is_hard_[2];
  bool shapes_stale_ = true;

  RowMatrix parameters_;
  Eigen::VectorXd measured_;
  std::vector<const Flags*> flags_;
  ShapeTable table_;
  /// By the signature of the knot before, the knot's own flags and those of the next one.
  std::map<std::tuple<const KnotSignature*, const Flags*, const Flags*>, const KnotSignature*>
      resolved_;
  std::vector<const KnotSignature*> signatures_;
  std::vector<const KnotShape*> shapes_;
  StageQp qp_;
  std::unordered_map<int, std::vector<QpStage>> idle_;  // by pattern, stages that no knot has now

  ThreadPool pool_;
  std::vector<FunctionWorkspace> workspaces_;
  std::vector<KnotBuffers> buffers_;
  std::vector<ThreadBuffers> thread_buffers_;  // [threads]
  std::vector<ExactBuffers> exact_buffers_;
  std::unique_ptr<FlagTable> flag_table_;
  std::vector<double> step_buffer_;
};

}  // namespace palanquin
