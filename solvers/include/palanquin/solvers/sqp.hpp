#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "palanquin/core/transcription/workspace.hpp"
#include "palanquin/solvers/damping.hpp"
#include "palanquin/solvers/deadline.hpp"
#include "palanquin/solvers/filter.hpp"
#include "palanquin/solvers/iteration_record.hpp"
#include "palanquin/solvers/kkt_error.hpp"
#include "palanquin/solvers/penalty_subproblem.hpp"
#include "palanquin/solvers/plan.hpp"
#include "palanquin/solvers/restoration.hpp"
#include "palanquin/solvers/single_user.hpp"
#include "palanquin/solvers/sqp_settings.hpp"
#include "palanquin/solvers/status.hpp"
#include "palanquin/solvers/unboundedness.hpp"

namespace palanquin {

/// Where the functions of exact Hessians come from; may answer null.
using ExactSource = std::function<std::shared_ptr<const ExactHessian>()>;

/// Memory for Sqp::feedback_gain.
struct GainWork {
  std::vector<double> gain, step, solver;
};

/// Sequential quadratic programming with penalties for the inequalities (De Vincenti and Coros,
/// section IV-A, after Grandia et al. 2022), on a lowered problem over N intervals.
///
/// One iteration, in order:
///   1. linearise all knots at the iterate: dynamics and rows to first order, cost to second
///      (Gauss-Newton for residuals; where that falls short or takes long, the Lagrangian's with
///      the multipliers of the last QP);
///   2. solve the QP with its penalties kept exact by semismooth Newton (PenaltySubproblem); with
///      `subproblem.max_inner_iterations` = 1 each penalty is its expansion at the iterate, as in
///      the paper;
///   3. step in the tangent space, shortened until the filter accepts; if no length is accepted, or
///      the Hessian did not factorise, 2 and 3 again with other Hessians or more
///      Levenberg-Marquardt damping;
///   4. if the QP has no solution, or no step is of use at a point that violates rows, step towards
///      the rows instead (Restoration); if no such step exists either, the problem is infeasible;
///   5. converged when the predicted decrease is small, the residuals hold and the Lagrangian's
///      gradient vanishes, whatever kind the last step was of.
/// docs/algorithms.md derives them.
///
/// With `max_iterations` = 1 and a shifted warm start it is the real-time iteration of the paper;
/// so is a `prepare` with its `feedback`. Its plan starts at the measurement whatever happens, and
/// the full step is the rule: a step is shortened only when it blows up (has_diverged).
///
/// A solver keeps its workspace between solves and serves one thread at a time: a call that meets
/// another one, getters included, throws std::logic_error. What getters refer to is valid until the
/// next solve; a Plan is a copy that stays. With Gauss-Newton Hessians a solve does not allocate
/// while the knots' dimensions stay what they were, unless it makes a Plan.
class Sqp {
 public:
  /// `exact` gives the functions of exact Hessians or null, and is called at most once: at once
  /// for HessianKind::Exact, which needs them; for Automatic by the first solve that would use
  /// them. Throws std::invalid_argument for invalid settings, horizon < 1, an unknown back end, or
  /// exact Hessians without their functions.
  Sqp(std::shared_ptr<const LoweredProblem> problem, int horizon, const SqpSettings& settings,
      ExactSource exact = nullptr);
  Sqp(const Sqp&) = delete;
  Sqp& operator=(const Sqp&) = delete;

  /// Changes how an inequality family enters, from the next `solve` or `prepare` on. Throws
  /// std::invalid_argument for an unknown family or invalid coefficients.
  void set_policy(const std::string& family, const Policy& policy);

  /// Solves from `guess` [N + 1, nz] for `parameters` [N + 1, np] and the `measured` knot [nz]
  /// (states at knot 0; other blocks as they were before it). The result is in trajectory().
  /// Throws std::invalid_argument for wrong shapes, non-finite input, and rows that the QP back end
  /// does not take; numerical failure is a status. A solve that `goes_on` stops, asked as Deadline
  /// says, ends as one whose time is up.
  Status solve(MatrixView parameters, VectorView measured, MatrixView guess,
               const GoesOn& goes_on = {});
  /// As `solve`, and the outcome as a value.
  Plan solve_plan(MatrixView parameters, VectorView measured, MatrixView guess,
                  const GoesOn& goes_on = {});

  /// One real-time iteration in two phases (Diehl et al. 2005). `prepare` linearises around
  /// `guess`, whose x_0 is the `predicted` knot's, and does all of the QP's work that does not need
  /// the measurement. `feedback` takes the `measured` knot, of which only the states may differ
  /// from `predicted`, and answers with a plan that starts there; feedback_ms() says how long that
  /// took. Returns false, with the reason in status() and message(), when there is nothing to feed
  /// back.
  /// `feedback` throws std::logic_error without a preparation; both throw as `solve`.
  bool prepare(MatrixView parameters, VectorView predicted, MatrixView guess);
  Status feedback(VectorView measured);
  Plan feedback_plan(VectorView measured);
  double feedback_ms() const;

  /// First-order feedback around the last solution: dz_0 = K dx_0, where dx_0 [ndx] is a change of
  /// the measured states in the tangent space and dz_0 [ndz] that of the first knot (rows of
  /// states and of fixed and absent blocks are zero). For controllers faster than the planner.
  /// Empty when the QP back end gives none (only "structured" does). Throws std::logic_error
  /// between `prepare` and `feedback`.
  Eigen::MatrixXd feedback_gain() const;
  /// The same into `gain`, which is resized to [ndz, ndx], or to [0, 0]; `work` is memory for it.
  /// Does not allocate where they were used for it before.
  void feedback_gain(Eigen::MatrixXd& gain, GainWork& work) const;

  /// Multipliers of the dynamics in the last QP [N, ndx], row k of those from knot k to k + 1: how
  /// the cost changes with an offset of x_{k+1}. Throws std::logic_error where blocks are carried,
  /// and between `prepare` and `feedback`.
  RowMatrix dynamics_multipliers() const;

  /// Cost of the last QP at its solution, penalties included: what a linear MPC minimises. NaN
  /// before the first.
  double model_cost() const;

  Status status() const;
  /// Whether the last solve's plan may be executed, see Plan::is_usable.
  bool has_usable_plan() const;
  /// Which test stopped the solve, in words.
  const std::string& message() const;
  /// The last accepted iterate [N + 1, nz].
  const RowMatrix& trajectory() const;
  /// Cost, penalty and residuals of trajectory(); NaN where the status is NonFinite.
  const Evaluation& evaluation() const;
  /// One record an iteration of the last solve.
  const std::vector<IterationRecord>& history() const;
  /// Sum over the history.
  PhaseTimes times() const;
  /// The outcome of the last solve as a value.
  Plan plan() const;

  const TranscriptionModel& model() const { return gauss_newton_.model(); }
  const SqpSettings& settings() const { return settings_; }
  /// Keeps other threads from changing the solver while several getters are read.
  [[nodiscard]] SingleUser::Use read(const char* call) const { return user_.read(call); }

 private:
  Status run(MatrixView parameters, VectorView measured, MatrixView guess, const GoesOn& goes_on);
  Status finish_feedback(VectorView measured);
  Plan make_plan() const;
  RowMultipliers row_multipliers() const;
  bool start(MatrixView parameters, VectorView measured, MatrixView guess);
  bool linearize(IterationRecord& record);
  bool prepare_exact();
  bool is_exact() const;
  bool adopt_exact();
  void use_exact_hessians(IterationRecord& record);
  void use_gauss_newton_hessians(IterationRecord& record);
  void change_kind(bool exact);
  void pause_exact();
  void add_damping();
  void take_step(IterationRecord& record, bool is_prepared);
  bool find_step(IterationRecord& record, bool is_prepared);
  bool solve_qp(IterationRecord& record, bool is_prepared);
  bool change_hessians(IterationRecord& record);
  bool search_step(IterationRecord& record);
  void try_length(double alpha);
  bool is_acceptable(double alpha, IterationRecord& record);
  bool is_cycle(const Merit& trial) const;
  void accept(double alpha, StepKind kind, IterationRecord& record);
  bool restore(IterationRecord& record);
  bool dynamics_hold() const;
  bool leave_stationary(IterationRecord& record);
  bool end_stationary(IterationRecord& record);
  bool search_restoration(IterationRecord& record);
  void keep_iterate(IterationRecord& record);
  void close(IterationRecord& record);
  void update_damping(const IterationRecord& record);
  double decrease_ratio(const IterationRecord& record) const;
  bool is_converged(IterationRecord& record);
  bool is_unbounded();
  bool is_feasible(const Evaluation& evaluation) const;
  bool is_saddle(const IterationRecord& record);
  void finish_converged(const IterationRecord& record);
  void finish_at_limit();
  bool goes_on(bool is_first_try);
  void keep_best();
  void finish_late();
  std::string describe_worst_rows(const RowMatrix& trajectory) const;
  std::string describe_contradiction();
  void finish_non_finite(NonFinite found);
  void mention_measured_rows();
  void finish(Status status, std::string_view message);

  SqpSettings settings_;
  SingleUser user_{"solver", " (plans may be read by any)"};
  ExactSource exact_source_;
  bool has_asked_for_exact_ = false;
  TranscriptionWorkspace gauss_newton_;
  std::unique_ptr<TranscriptionWorkspace> exact_;  ///< denser patterns; null while not needed
  TranscriptionWorkspace* transcription_ = &gauss_newton_;  ///< the one of the two in use
  std::shared_ptr<const RowPolicies> policies_;             ///< of the next solve
  std::unique_ptr<QpSolver> qp_solver_;
  PenaltySubproblem subproblem_;
  Filter filter_;
  Damping damping_;
  Restoration restoration_;
  int escapes_ = 0;  ///< from stationary points of the violation, in this solve
  UnboundednessTest unboundedness_;
  KktErrorEvaluator kkt_;
  StageQpSolution solution_;
  bool has_multipliers_ = false;  ///< of this solve, in solution_
  StageQpSolution certificate_;   ///< of infeasibility, empty otherwise
  NonFinite non_finite_;
  RowMatrix iterate_, trial_;
  Evaluation evaluation_, trial_evaluation_;
  Evaluation before_;  ///< of the iterate before the last accepted step
  Status status_ = Status::NotSolved;
  std::string message_;
  std::vector<IterationRecord> history_;
  double start_cost_ = Evaluation::kNaN;  ///< of the iterate that was linearised last
  double start_infeasibility_ = 0.0;
  double restored_below_ =
      0.0;  ///< residuals at which the restoration ends; infinite: there is none
  double added_damping_ = 0.0;            ///< to the Hessians of that linearisation
  bool uses_exact_ = false;               ///< the Hessians at hand are exact
  bool is_flat_ = false;                  ///< Gauss-Newton Hessians are singular
  int exact_from_ = 0, exact_pause_ = 0;  ///< iterations
  double idle_damping_ = 0.0;             ///< of the other kind of Hessians
  IterationRecord prepared_;
  bool is_prepared_ = false;
  bool is_real_time_ = false;  ///< the step at hand is a real-time iteration's
  Deadline deadline_;
  RowMatrix best_;  ///< the best iterate so far of a solve that has a time limit
  Evaluation best_evaluation_;
  double transcribe_ms_ = 0.0;
  double feedback_ms_ = Evaluation::kNaN;
};

}  // namespace palanquin
