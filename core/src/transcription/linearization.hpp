#pragma once

#include <vector>

#include "palanquin/core/stage_qp.hpp"
#include "transcription/knot_functions.hpp"
#include "transcription/stage_store.hpp"

namespace palanquin {

/// Derivatives of the lowered functions at all knots, gathered into the stages of a QP.
class Linearization {
 public:
  Linearization(const TranscriptionModel& model, int threads);

  /// Evaluates values, into `functions`, and derivatives, into `stages`. Throws
  /// std::invalid_argument if the dynamics depend on a local block.
  void evaluate(const TranscriptionInputs& inputs, const RowMatrix& trajectory,
                KnotFunctions& functions, StageStore& stages);
  /// Replaces the Hessians by exact ones, see TranscriptionWorkspace::use_exact_hessians.
  void use_exact_hessians(const TranscriptionInputs& inputs, const RowMatrix& trajectory,
                          const StageQpSolution& multipliers, bool convexify,
                          KnotFunctions& functions, StageStore& stages);
  /// Moves charted blocks of a knot onto their surfaces.
  void embed(const TranscriptionInputs& inputs, const KnotShape& shape, int knot,
             RowMatrix& trajectory, FunctionWorkspace& w);
  /// Slopes of the charts at a knot.
  const std::vector<double>& slopes(int knot) const { return slopes_[size_of(knot)]; }

 private:
  /// Results that a thread needs for one knot at a time.
  struct ThreadBuffers {
    explicit ThreadBuffers(const LoweredProblem& problem);
    std::vector<double> link_previous, link;  // Jacobians of the link rows
    std::vector<double> embedded;             // of the charts
    std::vector<double> unused_slopes;        // where only the charts' values are wanted
  };
  /// Arguments and results of the exact Hessian of one knot.
  struct ExactBuffers {
    ExactBuffers(const LoweredProblem& problem, const ExactHessian& exact);
    std::vector<double> hessian;
    std::vector<double> charted;                         // flag per block
    std::vector<double> dynamics, equality, inequality;  // multipliers of the lowered rows
    CurvatureMirror mirror;
  };

  void evaluate_charts(const TranscriptionInputs& inputs, const RowMatrix& trajectory,
                       const StageStore& stages, FunctionWorkspace& w);
  void gather(int knot, KnotResult result, const double* values, int stride, const KnotShape& shape,
              QpStage& stage);
  void evaluate_link(int thread, int knot, const TranscriptionInputs& inputs,
                     const RowMatrix& trajectory, KnotFunctions& functions, StageStore& stages);
  void fill_values(int knot, const RowMatrix& trajectory, const KnotValues& in,
                   StageStore& stages) const;
  void refuse_locals_in_dynamics() const;
  void set_multipliers(int knot, const StageQpSolution& multipliers, const KnotShape& shape,
                       const QpStage& stage);
  void evaluate_exact_hessian(int knot, const TranscriptionInputs& inputs,
                              const RowMatrix& trajectory, const KnotShape& shape, QpStage& stage,
                              FunctionWorkspace& w);

  const TranscriptionModel& model_;
  std::vector<std::vector<double>> slopes_;    // [N + 1]
  std::vector<int> local_entry_;               // [N + 1], of the dynamics' Jacobian, where a local
                                               // meets it; negative: none
  std::vector<ThreadBuffers> thread_buffers_;  // [threads]
  std::vector<ExactBuffers> exact_buffers_;    // [N + 1] or none
};

}  // namespace palanquin
