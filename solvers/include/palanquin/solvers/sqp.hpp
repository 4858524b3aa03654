#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "palanquin/core/transcription.hpp"
#include "palanquin/solvers/filter.hpp"
#include "palanquin/solvers/penalty_subproblem.hpp"
#include "palanquin/solvers/qp_settings.hpp"
#include "palanquin/solvers/status.hpp"

namespace palanquin {

/// Which second derivatives the QP has.
enum class HessianKind {
  GaussNewton,  ///< 2 J'WJ of the residuals; positive semidefinite without further ado
  Exact,        ///< of the stages' Lagrangians, see Transcription::use_exact_hessians
};

/// Settings of the SQP method.
struct SqpSettings {
  std::string qp = "structured";  ///< QP back end, one of qp_solver_names()
  Form form = Form::Reduced;
  HessianKind hessian = HessianKind::GaussNewton;
  int threads = 1;                   ///< for evaluating and linearising knots
  int max_iterations = 50;           ///< 1: real-time iteration
  double cost_tolerance = 1e-9;      ///< predicted decrease relative to the cost (or to 1)
  double equality_tolerance = 1e-8;  ///< largest equality residual of a converged point
  double regularization = 1e-4;      ///< proximal weight of the second attempt at a failed step
  bool globalize = true;             ///< false: full steps, checked for finiteness only
  LineSearchSettings line_search;
  PenaltySubproblemSettings subproblem;
  QpSettings qp_settings;

  /// An empty string, or a sentence that names field, value and rule.
  std::string explain_invalid() const;
};

/// How the step of one iteration was found.
enum class StepKind {
  Full,
  Damped,       ///< shortened by the filter
  Regularized,  ///< of a QP with a proximal term, after the plain one failed
  Rejected,     ///< none acceptable: the iterate was kept
};
std::string_view to_string(StepKind kind);

/// Milliseconds that one iteration (or a whole solve) spent per phase.
struct PhaseTimes {
  double transcribe = 0.0;  ///< parameters, measured state and guess taken over, roles settled
  double linearize = 0.0;
  double update = 0.0;     ///< QP back end: values and factorisation
  double solve = 0.0;      ///< QP back end: the rest, and the penalty subproblem's own work
  double globalize = 0.0;  ///< evaluations and line search
  double total() const { return transcribe + linearize + update + solve + globalize; }
};

/// What one iteration did; printing, histories and plots all read this record.
struct IterationRecord {
  double cost = 0.0;          ///< after the step, without penalties
  double penalty = 0.0;       ///< after the step
  double equality_max = 0.0;  ///< after the step
  double predicted = 0.0;     ///< change of cost and penalty that the QP predicted
  double step_length = 0.0;   ///< in (0, 1]; 0 when the iterate was kept
  StepKind step = StepKind::Rejected;
  bool refused_cycle = false;  ///< the full step led back to where the iteration was before
  int inner_iterations = 0;    ///< QP solves of the penalty subproblem
  QpStatus qp_status = QpStatus::NotSolved;
  PhaseTimes times;
};

/// Sequential quadratic programming with penalties for the inequalities (De Vincenti and Coros,
/// section IV-A, after Grandia et al. 2022), on a lowered problem over N intervals.
///
/// One iteration, in order:
///   1. linearise all knots at the iterate: dynamics and rows to first order, cost to second
///      (Gauss-Newton for residuals, or the Lagrangian's with the multipliers of the last QP);
///   2. solve the QP with its penalties kept exact by semismooth Newton (PenaltySubproblem); with
///      `subproblem.max_inner_iterations` = 1 each penalty is its expansion at the iterate, as in
///      the paper;
///   3. step in the tangent space, shortened until the filter accepts; if no length is accepted, or
///      the QP failed, once more with a proximal term, and then the iterate is kept.
///
/// With `max_iterations` = 1 and a shifted warm start it is the real-time iteration of the paper;
/// so is a `prepare` with its `feedback`. Its plan starts at the measurement whatever happens, and
/// the full step is the rule: a step is shortened only when it blows up (has_diverged). A solver is
/// used by one thread at a time and keeps its workspace between solves. With Gauss-Newton Hessians
/// a solve does not allocate while the knots' dimensions stay what they were.
class Sqp {
 public:
  /// `exact` is needed for exact Hessians. Throws std::invalid_argument for invalid settings,
  /// horizon < 1, an unknown back end, or exact Hessians without their functions.
  Sqp(std::shared_ptr<const LoweredProblem> problem, int horizon, const SqpSettings& settings,
      std::shared_ptr<const ExactHessian> exact = nullptr);

  void set_policy(const std::string& family, const Policy& policy);

  /// Solves from `guess` [N + 1, nz] for `parameters` [N + 1, np] and the `measured` knot [nz]
  /// (states at knot 0; other blocks as they were before it). The result is in trajectory().
  /// Throws std::invalid_argument for wrong shapes, non-finite input, and rows that the QP back end
  /// does not take; numerical failure is a status.
  Status solve(MatrixView parameters, VectorView measured, MatrixView guess);

  /// One real-time iteration in two phases (Diehl et al. 2005). `prepare` linearises around
  /// `guess`, whose x_0 is the `predicted` knot's, and does all of the QP's work that does not need
  /// the measurement. `feedback` takes the `measured` knot, of which only the states may differ
  /// from `predicted`, and answers with a plan that starts there; feedback_ms() says how long that
  /// took. Returns false, with the reason in status() and message(), when there is nothing to feed
  /// back.
  /// `feedback` throws std::logic_error without a preparation; both throw as `solve`.
  bool prepare(MatrixView parameters, VectorView predicted, MatrixView guess);
  Status feedback(VectorView measured);
  double feedback_ms() const { return feedback_ms_; }

  /// First-order feedback around the last solution: dz_0 = K dx_0, where dx_0 [ndx] is a change of
  /// the measured states in the tangent space and dz_0 [ndz] that of the first knot (rows of
  /// states and of fixed and absent blocks are zero). For controllers faster than the planner.
  /// Empty when the QP back end gives none (only "structured" does).
  Eigen::MatrixXd feedback_gain() const;

  /// Multipliers of the dynamics in the last QP [N, ndx], row k of those from knot k to k + 1: how
  /// the cost changes with an offset of x_{k+1}. Throws std::logic_error where blocks are carried,
  /// and between `prepare` and `feedback`.
  RowMatrix dynamics_multipliers() const;

  /// Cost of the last QP at its solution, penalties included: what a linear MPC minimises. NaN
  /// before the first.
  double model_cost() const;

  Status status() const { return status_; }
  /// Which test stopped the solve, in words.
  const std::string& message() const { return message_; }
  /// The last accepted iterate [N + 1, nz].
  const RowMatrix& trajectory() const { return iterate_; }
  /// Cost, penalty and residuals of trajectory().
  const Evaluation& evaluation() const { return evaluation_; }
  /// One record an iteration of the last solve.
  const std::vector<IterationRecord>& history() const { return history_; }
  /// Sum over the history.
  PhaseTimes times() const;

  Transcription& transcription() { return transcription_; }
  const SqpSettings& settings() const { return settings_; }

 private:
  bool start(MatrixView parameters, VectorView measured, MatrixView guess);
  bool linearize(IterationRecord& record);
  void take_step(IterationRecord& record, bool is_prepared);
  bool try_step(IterationRecord& record, double regularization, bool is_prepared);
  void keep_iterate(IterationRecord& record);
  bool search_step(IterationRecord& record);
  bool is_acceptable(double alpha, IterationRecord& record) const;
  std::string describe_contradiction();
  bool is_cycle(const Merit& trial) const;
  bool is_converged(const IterationRecord& record) const;
  void finish(Status status, std::string_view message);

  SqpSettings settings_;
  Transcription transcription_;
  std::unique_ptr<QpSolver> qp_solver_;
  PenaltySubproblem subproblem_;
  StageQpSolution solution_;
  RowMatrix iterate_, trial_;
  Evaluation evaluation_, trial_evaluation_;
  Status status_ = Status::NotSolved;
  std::string message_;
  std::vector<IterationRecord> history_;
  double start_cost_ = 0.0;  ///< of the iterate that was linearised last
  IterationRecord prepared_;
  bool is_prepared_ = false;
  bool is_real_time_ = false;  ///< the step at hand is a real-time iteration's
  double transcribe_ms_ = 0.0;
  double feedback_ms_ = 0.0;
};

}  // namespace palanquin
