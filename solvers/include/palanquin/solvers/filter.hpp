#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace palanquin {

/// Parameters of the filter line search (Grandia et al. 2022, section V-E, reference [20] of De
/// Vincenti and Coros). theta is the 2-norm of the equality residuals and violated hard rows, phi
/// the cost with penalties.
struct LineSearchSettings {
  double max_infeasibility = 1e2;   ///< above: accept only if theta falls by max_relative_decrease
  double min_infeasibility = 1e-6;  ///< both below: accept on phi's Armijo decrease alone
  double infeasibility_decrease = 1e-4;  ///< gamma_theta
  double cost_decrease = 1e-6;           ///< gamma_phi
  /// Changes of phi below this, relative to phi or to 1, decide nothing: the last residuals' share
  /// in phi (multiplier times residual) and rounding are of that order.
  double cost_resolution = 1e-9;
  double armijo = 1e-4;      ///< fraction of the predicted decrease of phi
  double contraction = 0.5;  ///< of the step length, in (0, 1)
  double min_step = 1e-4;    ///< shortest step length that is tried
  /// A real-time step diverges when cost or residuals are this many times what they should be, see
  /// has_diverged.
  double divergence = 1e2;

  /// An empty string, or a sentence that names field, value and rule.
  std::string explain_invalid() const;
};

/// A trajectory as the filter sees it.
struct Merit {
  double infeasibility = 0.0;  ///< theta
  double cost = 0.0;           ///< phi
};

/// Whether a step of length `alpha` from `current` to `trial` is acceptable. `directional_cost` is
/// the predicted change of phi for a full step (negative: decrease).
bool is_step_acceptable(const LineSearchSettings& settings, const Merit& current,
                        const Merit& trial, double alpha, double directional_cost);

/// The points that a line search may not come back to (Waechter and Biegler 2006): a trial has to
/// beat the residuals or the cost of each of them. Steps that lower the cost of a feasible point
/// need no entry.
class Filter {
 public:
  void reset() { entries_.clear(); }
  void reserve(std::size_t count) { entries_.reserve(count); }
  void add(const Merit& merit) { entries_.push_back(merit); }
  bool accepts(const LineSearchSettings& settings, const Merit& trial) const;

 private:
  std::vector<Merit> entries_;
};

/// Whether both points count as feasible, so that the cost alone decides between them.
bool are_feasible(const LineSearchSettings& settings, const Merit& current, const Merit& trial);

/// Whether a real-time step from `current` to `trial` blew up: its values are not finite, its cost
/// lies above `divergence` times the largest of |phi|, |modelled_cost| (what the QP expected of the
/// full step) and 1, or its residuals above max_infeasibility and `divergence` times theta.
///
/// No decrease is asked for: `current` starts where the measurement was expected, and what the
/// measurement really is may cost more than any step can gain (docs/algorithms.md, section 1).
bool has_diverged(const LineSearchSettings& settings, const Merit& current, const Merit& trial,
                  double modelled_cost);

}  // namespace palanquin
