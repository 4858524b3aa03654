#pragma once

#include <Eigen/Core>

#include "palanquin/core/stage_qp.hpp"

namespace palanquin {

/// How far an iterate is from a KKT point of the nonlinear program, by the linearisation `qp` made
/// there (docs/algorithms.md, section 2).
struct KktError {
  /// Largest entry of the Lagrangian's gradient at w = 0, relative to the cost's or to 1.
  double stationarity = 0.0;
  /// Largest |nu h| of hard rows, in the same scale, and largest -nu.
  double complementarity = 0.0;
};

/// Evaluates it with the multipliers that the QP's solution has; owns its workspace.
class KktErrorEvaluator {
 public:
  /// `solution` has the sizes of `qp`; its step is not looked at.
  KktError evaluate(const StageQp& qp, const StageQpSolution& solution);

 private:
  double add_cost_gradient(const QpStage& stage);

  Eigen::VectorXd gradient_, rows_;
};

/// The 2-norm of all multipliers but that of x_0, which no step changes.
double multiplier_norm(const StageQpSolution& solution);

}  // namespace palanquin
