#pragma once

#include <string>

#include "palanquin/solvers/kernel_level.hpp"

namespace palanquin {

/// Settings of the back end "structured"; see qp_structured.hpp.
struct StructuredQpSettings {
  KernelLevel kernels = KernelLevel::Automatic;
  /// Added to the diagonal of the inputs' and locals' Hessian, for problems that are not strictly
  /// convex in them. The QP that is solved is then the regularised one. [>= 0]
  double regularization = 0.0;
  /// A pivot must be above this times the diagonal entry that it started from. [>= 0, < 1]
  double pivot_tolerance = 1e-14;
  /// Stiffness that stands in for an equality row inside the factorisation, times the largest
  /// diagonal entry of the knot's Hessian over the row's squared norm. [> 0]
  double equality_weight = 1e6;
  /// Equality rows are refined until residuals are below this, relative to the data. [> 0]
  double equality_tolerance = 1e-11;
  int max_refinements = 20;  ///< [>= 1]

  /// An empty string, or a sentence that names field, value and rule.
  std::string explain_invalid() const;
};

}  // namespace palanquin
