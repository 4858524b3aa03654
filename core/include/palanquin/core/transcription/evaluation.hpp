#pragma once

#include <limits>
#include <vector>

#include "palanquin/core/transcription/inputs.hpp"
#include "palanquin/core/transcription/knot_shape.hpp"

namespace palanquin {

/// Merit quantities of a trajectory; NaN until it has been evaluated, and where it is not finite.
struct Evaluation {
  static constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

  double cost = kNaN;            ///< objective without penalties
  double penalty = kNaN;         ///< sum of all penalties
  double equality_max = kNaN;    ///< largest |residual| of dynamics, equality and link rows
  double infeasibility = kNaN;   ///< 2-norm of those residuals and of violated hard rows
  double inequality_max = kNaN;  ///< largest violation of a hard row
  bool is_finite = false;
  double total() const { return cost + penalty; }
};

/// Values of the lowered functions at one knot.
struct KnotValues {
  explicit KnotValues(const LoweredProblem& problem);

  std::vector<double> next_state;  ///< d, ambient, states only
  std::vector<double> defect;      ///< d (-) x+ in the tangent space
  double cost = 0.0;
  std::vector<double> equality, inequality, link;
};

/// What the values of all knots add up to; `rows` and `values` are [N + 1].
Evaluation summarize(const std::vector<const KnotRows*>& rows, const RowPolicies& policies,
                     const std::vector<KnotValues>& values);

}  // namespace palanquin
