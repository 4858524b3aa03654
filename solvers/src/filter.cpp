#include "palanquin/solvers/filter.hpp"

#include <algorithm>
#include <cmath>

#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

bool is_step_acceptable(const LineSearchSettings& s, const Merit& current, const Merit& trial,
                        double alpha, double directional_cost) {
  if (!std::isfinite(trial.infeasibility) || !std::isfinite(trial.cost)) return false;
  const double slack = s.cost_resolution * std::max(1.0, std::abs(current.cost));

  if (trial.infeasibility > s.max_infeasibility)
    return trial.infeasibility < (1.0 - s.infeasibility_decrease) * current.infeasibility;
  if (are_feasible(s, current, trial) && directional_cost < 0.0)
    return trial.cost < current.cost + s.armijo * alpha * directional_cost + slack;
  return trial.cost < current.cost - s.cost_decrease * current.infeasibility + slack ||
         trial.infeasibility < (1.0 - s.infeasibility_decrease) * current.infeasibility;
}

bool are_feasible(const LineSearchSettings& s, const Merit& current, const Merit& trial) {
  return std::max(trial.infeasibility, current.infeasibility) < s.min_infeasibility;
}

bool Filter::accepts(const LineSearchSettings& s, const Merit& trial) const {
  return std::all_of(entries_.begin(), entries_.end(), [&](const Merit& entry) {
    const double slack = s.cost_resolution * std::max(1.0, std::abs(entry.cost));
    return trial.infeasibility < (1.0 - s.infeasibility_decrease) * entry.infeasibility ||
           trial.cost < entry.cost - s.cost_decrease * entry.infeasibility + slack;
  });
}

bool has_diverged(const LineSearchSettings& s, const Merit& current, const Merit& trial,
                  double modelled_cost) {
  if (!std::isfinite(trial.infeasibility) || !std::isfinite(trial.cost)) return true;
  const double expected = std::max({1.0, std::abs(current.cost), std::abs(modelled_cost)});
  return trial.cost > s.divergence * expected ||
         trial.infeasibility > std::max(s.max_infeasibility, s.divergence * current.infeasibility);
}

}  // namespace palanquin
