#include "palanquin/control/planning/sqp_settings_text.hpp"

#include <stdexcept>
#include <type_traits>

namespace palanquin::planning {

namespace {

/// Calls visit(name, field) for every field of the settings.
template <typename Settings, typename Visit>
void visit_fields(Settings& s, Visit visit) {
  visit("qp", s.qp);
  visit("form", s.form);
  visit("hessian", s.hessian);
  visit("exact_after", s.exact_after);
  visit("threads", s.threads);
  visit("max_iterations", s.max_iterations);
  visit("max_seconds", s.max_seconds);
  visit("cost_tolerance", s.cost_tolerance);
  visit("equality_tolerance", s.equality_tolerance);
  visit("stationarity_tolerance", s.stationarity_tolerance);
  visit("usable_violation", s.usable_violation);
  visit("unbounded_size", s.unbounded_size);
  visit("globalize", s.globalize);
  auto& search = s.line_search;
  visit("line_search.max_infeasibility", search.max_infeasibility);
  visit("line_search.min_infeasibility", search.min_infeasibility);
  visit("line_search.infeasibility_decrease", search.infeasibility_decrease);
  visit("line_search.cost_decrease", search.cost_decrease);
  visit("line_search.armijo", search.armijo);
  visit("line_search.cost_resolution", search.cost_resolution);
  visit("line_search.contraction", search.contraction);
  visit("line_search.min_step", search.min_step);
  visit("line_search.divergence", search.divergence);
  visit("damping.first", s.damping.first);
  visit("damping.smallest", s.damping.smallest);
  visit("damping.largest", s.damping.largest);
  visit("damping.growth", s.damping.growth);
  visit("damping.poor", s.damping.poor);
  visit("damping.max_attempts", s.damping.max_attempts);
  visit("restoration.proximal", s.restoration.proximal);
  visit("restoration.certificate", s.restoration.certificate);
  visit("restoration.elastic", s.restoration.elastic);
  visit("subproblem.max_inner_iterations", s.subproblem.max_inner_iterations);
  visit("subproblem.tolerance", s.subproblem.tolerance);
  visit("subproblem.decrease_tolerance", s.subproblem.decrease_tolerance);
  auto& structured = s.qp_settings.structured;
  visit("qp_settings.structured.kernels", structured.kernels);
  visit("qp_settings.structured.regularization", structured.regularization);
  visit("qp_settings.structured.pivot_tolerance", structured.pivot_tolerance);
  visit("qp_settings.structured.equality_weight", structured.equality_weight);
  visit("qp_settings.structured.equality_tolerance", structured.equality_tolerance);
  visit("qp_settings.structured.max_refinements", structured.max_refinements);
  auto& ldl = s.qp_settings.ldl;
  visit("qp_settings.ldl.primal_regularization", ldl.primal_regularization);
  visit("qp_settings.ldl.dual_regularization", ldl.dual_regularization);
  visit("qp_settings.ldl.max_refinements", ldl.max_refinements);
  visit("qp_settings.ldl.tolerance", ldl.tolerance);
  auto& osqp = s.qp_settings.osqp;
  visit("qp_settings.osqp.absolute_tolerance", osqp.absolute_tolerance);
  visit("qp_settings.osqp.relative_tolerance", osqp.relative_tolerance);
  visit("qp_settings.osqp.infeasibility_tolerance", osqp.infeasibility_tolerance);
  visit("qp_settings.osqp.max_iterations", osqp.max_iterations);
  visit("qp_settings.osqp.check_interval", osqp.check_interval);
  visit("qp_settings.osqp.rho", osqp.rho);
  visit("qp_settings.osqp.adaptive_rho_interval", osqp.adaptive_rho_interval);
  visit("qp_settings.osqp.sigma", osqp.sigma);
  visit("qp_settings.osqp.relaxation", osqp.relaxation);
  visit("qp_settings.osqp.scaling_iterations", osqp.scaling_iterations);
  visit("qp_settings.osqp.polish", osqp.polish);
  visit("qp_settings.osqp.polish_refinements", osqp.polish_refinements);
  auto& multipliers = s.qp_settings.multipliers;
  visit("qp_settings.multipliers.stiffness", multipliers.stiffness);
  visit("qp_settings.multipliers.tolerance", multipliers.tolerance);
  visit("qp_settings.multipliers.fast_iterations", multipliers.fast_iterations);
  visit("qp_settings.multipliers.max_iterations", multipliers.max_iterations);
  visit("qp_settings.multipliers.curvature_floor", multipliers.curvature_floor);
}

std::string in_words(const std::string& value) { return value; }
template <typename Value>
std::string in_words(Value value) {
  if constexpr (std::is_same_v<Value, double>)
    return palanquin::to_text(value);
  else
    return std::to_string(static_cast<int>(value));
}

void read(TextLine& line, std::string& value) { value = line.word(); }
void read(TextLine& line, double& value) { value = line.number(); }
void read(TextLine& line, int& value) { value = line.integer(0); }

constexpr int last(bool) { return 1; }
constexpr int last(Form) { return static_cast<int>(Form::Paper); }
constexpr int last(HessianKind) { return static_cast<int>(HessianKind::Automatic); }
constexpr int last(KernelLevel) { return static_cast<int>(KernelLevel::Avx512); }

template <typename Choice>
void read(TextLine& line, Choice& value) {
  const int number = line.integer(0);
  if (number > last(value))
    throw std::runtime_error("it is " + std::to_string(number) + ", but must be at most " +
                             std::to_string(last(value)));
  value = static_cast<Choice>(number);
}

}  // namespace

std::string to_text(const SqpSettings& settings) {
  std::string text;
  visit_fields(settings, [&](const char* name, const auto& value) {
    text += std::string("setting ") + name + ' ' + in_words(value) + '\n';
  });
  return text;
}

void read_setting(TextLine& line, SqpSettings& settings) {
  const std::string wanted = line.word();
  bool is_known = false;
  visit_fields(settings, [&](const char* name, auto& value) {
    if (wanted != name) return;
    read(line, value);
    is_known = true;
  });
  if (!is_known) throw std::runtime_error("there is no setting '" + wanted + "'");
}

}  // namespace palanquin::planning
