#pragma once

#include <string>

namespace palanquin {

/// How an inequality row h <= 0 enters the problem.
enum class PolicyKind : int {
  Hard = 0,            ///< kept as a constraint; needs a back end that takes inequalities
  C2Penalty = 1,       ///< twice continuously differentiable penalty, De Vincenti and Coros eq. 15
  SquaredHinge = 2,    ///< K max(h, 0)^2
  RelaxedBarrier = 3,  ///< -mu log(-h), continued quadratically beyond h = -delta
};

/// A penalty S(h) with its two parameters, changeable between two solves.
///
/// C2Penalty (stiffness K, smoothing eps):
///   S(h) = K (h^2 + eps^2/3)                                for h >= eps
///        = K (h^3/(6 eps) + h^2/2 + eps h/2 + eps^2/6)      for |h| < eps
///        = 0                                                for h <= -eps
/// The paper prints the middle branch with the odd terms' signs reversed, which makes it jump at
/// +-eps; with the signs above value, slope and curvature are continuous.
///
/// SquaredHinge (stiffness K): S(h) = K max(h, 0)^2; smoothing is not used.
///
/// RelaxedBarrier (stiffness mu, smoothing delta): S(h) = -mu log(-h) for h <= -delta, and the
/// quadratic with the same value, slope and curvature at -delta beyond (Grandia et al. 2022).
struct Policy {
  PolicyKind kind = PolicyKind::C2Penalty;
  double stiffness = 420.0;
  double smoothing = 1e-3;

  /// An empty string, or a sentence that names field, value and rule.
  std::string explain_invalid() const;
  bool operator==(const Policy&) const = default;
};

/// The largest h up to which a penalty, its slope and its curvature vanish, as those of most rows
/// do; minus infinity when there is none.
double vanishes_until(const Policy& policy);

/// Value, slope and curvature of a penalty at one point.
struct PenaltyValue {
  double value = 0.0;
  double slope = 0.0;
  double curvature = 0.0;
};

/// Evaluates S, S', S'' at `h`. A hard policy evaluates to zero.
PenaltyValue evaluate_penalty(const Policy& policy, double h);

}  // namespace palanquin
