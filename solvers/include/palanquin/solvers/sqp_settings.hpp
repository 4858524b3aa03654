#pragma once

#include <string>

#include "palanquin/core/transcription/model.hpp"
#include "palanquin/solvers/damping.hpp"
#include "palanquin/solvers/filter.hpp"
#include "palanquin/solvers/penalty_subproblem.hpp"
#include "palanquin/solvers/qp_settings.hpp"
#include "palanquin/solvers/restoration.hpp"

namespace palanquin {

/// Which second derivatives the QP has.
enum class HessianKind {
  GaussNewton,  ///< 2 J'WJ of the residuals; positive semidefinite without further ado
  Exact,        ///< of the stages' Lagrangians, see TranscriptionWorkspace::use_exact_hessians
  /// Gauss-Newton's until a QP or a step with them fails, or for `exact_after` iterations; then
  /// exact ones, if the problem has their functions. Real-time steps stay with Gauss-Newton's.
  Automatic,
};

/// Settings of the SQP method.
struct SqpSettings {
  std::string qp = "structured";  ///< QP back end, one of qp_solver_names()
  Form form = Form::Reduced;
  HessianKind hessian = HessianKind::Automatic;
  int exact_after = 10;      ///< iterations, see HessianKind::Automatic
  int threads = 1;           ///< for evaluating and linearising knots
  int max_iterations = 200;  ///< 1: real-time iteration
  /// Wall time of a solve. It is looked at between iterations, attempts at a step and step lengths,
  /// not within one linearisation or QP; the first QP and its full step are always tried. A
  /// feedback phase has no limit.
  double max_seconds = 1e9;
  double cost_tolerance = 1e-9;      ///< predicted decrease relative to the cost (or to 1)
  double equality_tolerance = 1e-8;  ///< largest residual of a converged point, hard rows too
  /// Of a converged point: largest entry of the Lagrangian's gradient and |nu h| of hard rows,
  /// relative to the largest entry of the cost's gradient (or to 1).
  double stationarity_tolerance = 1e-5;
  double usable_violation = 1.0;  ///< largest residual of an equality or hard row, in its own
                                  ///< unit, of a plan that may be executed (Plan::is_usable)
  double unbounded_size = 1e6;  ///< a trajectory this large, relative to the guess (or to 1), whose
                                ///< cost goes on falling, is said to have no minimum
  bool globalize = true;        ///< false: full steps, checked for finiteness only
  LineSearchSettings line_search;
  DampingSettings damping;
  RestorationSettings restoration;
  PenaltySubproblemSettings subproblem;
  QpSettings qp_settings;

  /// An empty string, or a sentence that names field, value and rule.
  std::string explain_invalid() const;
};

}  // namespace palanquin
