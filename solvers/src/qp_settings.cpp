#include "palanquin/solvers/qp_settings.hpp"

#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

std::string LdlSettings::explain_invalid() const {
  return SettingRules("ldl.")
      .positive("primal_regularization", primal_regularization)
      .positive("dual_regularization", dual_regularization)
      .at_least("max_refinements", max_refinements, 0)
      .positive("tolerance", tolerance)
      .sentence();
}

std::string OsqpSettings::explain_invalid() const {
  return SettingRules("osqp.")
      .positive("absolute_tolerance", absolute_tolerance)
      .not_negative("relative_tolerance", relative_tolerance)
      .positive("infeasibility_tolerance", infeasibility_tolerance)
      .at_least("max_iterations", max_iterations, 1)
      .at_least("check_interval", check_interval, 1)
      .positive("rho", rho)
      .at_least("adaptive_rho_interval", adaptive_rho_interval, 0)
      .positive("sigma", sigma)
      .check(relaxation > 0.0 && relaxation < 2.0, "relaxation", relaxation, "between 0 and 2")
      .at_least("scaling_iterations", scaling_iterations, 0)
      .at_least("polish_refinements", polish_refinements, 0)
      .sentence();
}

std::string MultipliersSettings::explain_invalid() const {
  return SettingRules("multipliers.")
      .positive("stiffness", stiffness)
      .positive("tolerance", tolerance)
      .at_least("fast_iterations", fast_iterations, 1)
      .at_least("max_iterations", max_iterations, 1)
      .check(curvature_floor >= 0.0 && curvature_floor < 1.0, "curvature_floor", curvature_floor,
             "in [0, 1)")
      .sentence();
}

std::string QpSettings::explain_invalid() const {
  return SettingRules()
      .nested(structured.explain_invalid())
      .nested(ldl.explain_invalid())
      .nested(osqp.explain_invalid())
      .nested(multipliers.explain_invalid())
      .sentence();
}

}  // namespace palanquin
