#pragma once

#include <string>

#include "palanquin/solvers/structured_settings.hpp"

namespace palanquin {

/// Settings of the back end "ldl": one sparse LDL' of the regularised KKT matrix
///   [P + primal I, A'; A, -dual I],
/// refined against the unregularised one.
struct LdlSettings {
  double primal_regularization = 1e-9;  ///< [cost per unit squared], positive
  double dual_regularization = 1e-9;    ///< positive
  int max_refinements = 10;             ///< steps of iterative refinement
  double tolerance = 1e-10;             ///< residual of a solved KKT system, relative

  std::string explain_invalid() const;
};

/// Settings of the back end "osqp"; symbols as in Stellato et al. 2020.
struct OsqpSettings {
  double absolute_tolerance = 1e-5;
  double relative_tolerance = 1e-5;
  double infeasibility_tolerance = 1e-5;  ///< primal and dual certificates
  int max_iterations = 4000;
  int check_interval = 10;          ///< iterations between two termination checks
  double rho = 0.1;                 ///< step size, adapted from there
  int adaptive_rho_interval = 100;  ///< iterations between two adaptations, 0: rho stays. Counted,
                                    ///< never timed, so that equal runs give equal results
  double sigma = 1e-6;              ///< proximal weight of the variables
  double relaxation = 1.6;          ///< alpha, in (0, 2)
  int scaling_iterations = 10;      ///< of Ruiz equilibration at each update, 0: none
  bool polish = false;              ///< solve the active set's KKT system at the end
  int polish_refinements = 3;

  std::string explain_invalid() const;
};

/// Settings of the back end "structured" for QPs with hard rows. The recursion's own settings are
/// StructuredQpSettings.
struct MultipliersSettings {
  double stiffness = 1e4;   ///< rho of a row, times the curvature of the variables that it is over
  double tolerance = 1e-8;  ///< on hard rows, in their unit
  int fast_iterations =
      30;  ///< recursions from the warm start before the interior point takes over
  int max_iterations = 300;  ///< Riccati recursions in all
  /// Curvature, of the cost's largest, that directions get which neither cost nor rows bend, so
  /// that hard rows alone hold them (a linear program). The gradient is then wrong by this share of
  /// the solution's size. 0: such a QP ends as FactorizationFailed, which an SQP answers with
  /// damping.
  double curvature_floor = 0.0;

  std::string explain_invalid() const;
};

/// Settings of every QP back end, each under its own name.
struct QpSettings {
  StructuredQpSettings structured;
  LdlSettings ldl;
  OsqpSettings osqp;
  MultipliersSettings multipliers;

  /// An empty string, or a sentence that names field, value and rule.
  std::string explain_invalid() const;
};

}  // namespace palanquin
