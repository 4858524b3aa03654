#pragma once

#include <Eigen/Core>
#include <memory>

#include "palanquin/solvers/qp_solver.hpp"
#include "palanquin/solvers/structured_settings.hpp"

namespace palanquin {

namespace structured {
struct Workspace;
}

/// Riccati recursion over the knots of a StageQp, one knot's work per knot.
///
/// The value function of knot k + 1 is V(x) = 1/2 x'P x + p'x. Backwards, per knot,
///   (1) the implicit rows x+ = (I - N)^{-1} (F w + b) are substituted into P: P~ = L'P L,
///   (2) W = P~ F goes over the stored entries of F only,
///   (3) G = H + F'W + J'D J is formed, lower triangle only, its gradient as one more row,
///   (4) locals are eliminated group by group, touching only the columns that they meet,
///   (5) a partial Cholesky of G over the inputs leaves P and p of knot k;
/// and forwards (6) inputs, locals and next states follow from the initial state.
/// docs/structured-solver.md derives it. Work is linear in the horizon.
///
/// Equality rows enter (3) as stiff quadratic rows and are then made exact by refining with the
/// same factors (a proximal method of multipliers). Link rows are not taken. Hard rows are where
/// the model replaces them by quadratics too: its lists then go on with theirs, behind the
/// penalised rows. The back end "structured" puts two methods that do so around this class
/// (docs/hard-rows.md).
///
/// For real-time iterations `factorize` does all that can be done before the initial state is
/// known, `feedback` the rest. Nothing allocates once a pattern of these sizes has been analysed.
///
///   StructuredQpSolver solver;
///   StageQpSolution step;
///   step.resize(qp);
///   if (is_usable(solver.factorize(qp, model))) solver.feedback(measured_state, step);
class StructuredQpSolver final : public QpSolver {
 public:
  /// Throws std::invalid_argument if a setting breaks its rule.
  explicit StructuredQpSolver(const StructuredQpSettings& settings = {});
  ~StructuredQpSolver() override;
  StructuredQpSolver(StructuredQpSolver&&) noexcept;
  StructuredQpSolver& operator=(StructuredQpSolver&&) noexcept;

  std::string_view name() const override { return "structured"; }
  QpCapabilities capabilities() const override { return {.tells_inertia = true}; }

  /// factorize, then feedback from qp.initial_state.
  QpStatus solve(const StageQp& qp, const PenaltyModel& model, StageQpSolution& solution) override;

  /// As solve, if since the last factorisation of `qp` nothing but `model` and the initial state
  /// has changed: knots behind the last one whose penalties changed keep their factors.
  QpStatus resolve(const StageQp& qp, const PenaltyModel& model,
                   StageQpSolution& solution) override;

  /// Throws std::invalid_argument for wrong sizes.
  void find_dynamics_multipliers(StageQpSolution& solution) override;

  /// factorize, and feedback from qp.initial_state; the gain is input_gain(0).
  QpStatus prepare(const StageQp& qp, const PenaltyModel& model) override {
    return factorize(qp, model);
  }
  QpStatus finish(const StageQp& qp, const PenaltyModel& model,
                  StageQpSolution& solution) override {
    update_ms_ = 0.0;
    const QpStatus status = feedback(qp.initial_state, solution);
    return status == QpStatus::NotSolved ? solve_stiffly(qp, model, solution) : status;
  }
  bool feedback_gain(Eigen::Ref<Eigen::MatrixXd> gain, std::vector<double>& work) const override {
    write_input_gain(0, gain, work);
    return true;
  }

  /// Steps (1) to (5). `qp` must live, unchanged, until the last feedback. Throws
  /// std::invalid_argument if a block's dimensions contradict its knot's.
  QpStatus factorize(const StageQp& qp, const PenaltyModel& model);

  /// Step (6) with the last factors, from `initial_state` [nx_0]. Throws std::logic_error if no
  /// factorisation stands, std::invalid_argument for wrong sizes.
  QpStatus feedback(const Eigen::VectorXd& initial_state, StageQpSolution& solution);

  /// StructuredQpSettings::regularization from the next factorisation on.
  void set_regularization(double regularization);

  /// du_k/dx_k of the last factors [nu_k x nx_k]: the first-order feedback gain, penalties at the
  /// model's curvature. With equality rows up to a relative 1 / equality_weight.
  Eigen::MatrixXd input_gain(int knot) const;
  /// The same into `gain` of that size.
  void write_input_gain(int knot, Eigen::Ref<Eigen::MatrixXd> gain,
                        std::vector<double>& work) const;
  /// The value function's Hessian [nx_k x nx_k] and gradient [nx_k] at `knot`.
  Eigen::MatrixXd value_hessian(int knot) const;
  Eigen::VectorXd value_gradient(int knot) const;

  /// Floating-point operations of one solve of the last pattern, counted without padding and
  /// without penalty rows (which cost only where their curvature is not zero) or refinements.
  double flops() const;
  KernelLevel kernel_level() const;

 private:
  QpStatus factorize(const StageQp& qp, const PenaltyModel& model, double share);
  QpStatus solve_stiffly(const StageQp& qp, const PenaltyModel& model, StageQpSolution& solution);

  std::unique_ptr<structured::Workspace> workspace_;
};

}  // namespace palanquin
