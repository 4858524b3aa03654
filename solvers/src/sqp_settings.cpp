#include "palanquin/solvers/sqp_settings.hpp"

#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

std::string SqpSettings::explain_invalid() const {
  return SettingRules("sqp.")
      .at_least("threads", threads, 1)
      .at_least("exact_after", exact_after, 1)
      .at_least("max_iterations", max_iterations, 1)
      .positive("max_seconds", max_seconds)
      .positive("cost_tolerance", cost_tolerance)
      .positive("equality_tolerance", equality_tolerance)
      .positive("stationarity_tolerance", stationarity_tolerance)
      .positive("usable_violation", usable_violation)
      .positive("unbounded_size", unbounded_size)
      .nested(line_search.explain_invalid())
      .nested(damping.explain_invalid())
      .nested(restoration.explain_invalid())
      .nested(subproblem.explain_invalid())
      .nested(qp_settings.explain_invalid())
      .sentence();
}

std::string LineSearchSettings::explain_invalid() const {
  return SettingRules("line_search.")
      .positive("max_infeasibility", max_infeasibility)
      .positive("min_infeasibility", min_infeasibility)
      .positive("infeasibility_decrease", infeasibility_decrease)
      .positive("cost_decrease", cost_decrease)
      .not_negative("cost_resolution", cost_resolution)
      .positive("armijo", armijo)
      .check(contraction > 0.0 && contraction < 1.0, "contraction", contraction, "in (0, 1)")
      .check(min_step > 0.0 && min_step <= 1.0, "min_step", min_step, "in (0, 1]")
      .check(divergence > 1.0, "divergence", divergence, "above 1")
      .sentence();
}

}  // namespace palanquin
