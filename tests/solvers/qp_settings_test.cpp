#include "palanquin/solvers/qp_settings.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

#include "palanquin/solvers/qp_factory.hpp"

namespace palanquin {
namespace {

TEST(QpSettings, DefaultsAreValid) { EXPECT_EQ(QpSettings{}.explain_invalid(), ""); }

struct BadSetting {
  std::string field;
  std::function<void(QpSettings&)> spoil;
};

TEST(QpSettings, NamesTheFieldTheValueAndTheRule) {
  const BadSetting bad_settings[] = {
      {"ldl.primal_regularization", [](auto& s) { s.ldl.primal_regularization = -7; }},
      {"ldl.dual_regularization", [](auto& s) { s.ldl.dual_regularization = -7; }},
      {"ldl.max_refinements", [](auto& s) { s.ldl.max_refinements = -7; }},
      {"ldl.tolerance", [](auto& s) { s.ldl.tolerance = -7; }},
      {"osqp.absolute_tolerance", [](auto& s) { s.osqp.absolute_tolerance = -7; }},
      {"osqp.relative_tolerance", [](auto& s) { s.osqp.relative_tolerance = -7; }},
      {"osqp.infeasibility_tolerance", [](auto& s) { s.osqp.infeasibility_tolerance = -7; }},
      {"osqp.max_iterations", [](auto& s) { s.osqp.max_iterations = -7; }},
      {"osqp.check_interval", [](auto& s) { s.osqp.check_interval = -7; }},
      {"osqp.rho", [](auto& s) { s.osqp.rho = -7; }},
      {"osqp.adaptive_rho_interval", [](auto& s) { s.osqp.adaptive_rho_interval = -7; }},
      {"osqp.sigma", [](auto& s) { s.osqp.sigma = -7; }},
      {"osqp.relaxation", [](auto& s) { s.osqp.relaxation = -7; }},
      {"osqp.scaling_iterations", [](auto& s) { s.osqp.scaling_iterations = -7; }},
      {"osqp.polish_refinements", [](auto& s) { s.osqp.polish_refinements = -7; }},
      {"multipliers.stiffness", [](auto& s) { s.multipliers.stiffness = -7; }},
      {"multipliers.tolerance", [](auto& s) { s.multipliers.tolerance = -7; }},
      {"multipliers.fast_iterations", [](auto& s) { s.multipliers.fast_iterations = -7; }},
      {"multipliers.max_iterations", [](auto& s) { s.multipliers.max_iterations = -7; }},
  };
  for (const BadSetting& bad : bad_settings) {
    QpSettings settings;
    bad.spoil(settings);
    EXPECT_EQ(settings.explain_invalid().find(bad.field + " is -7, but must be "), 0u)
        << settings.explain_invalid();
  }
}

TEST(QpSettings, NaNIsNotANumberToAccept) {
  QpSettings settings;
  settings.osqp.rho = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(settings.explain_invalid().find("osqp.rho is nan"), std::string::npos);
}

TEST(QpFactory, RefusesBadSettings) {
  QpSettings settings;
  settings.osqp.rho = -1.0;
  EXPECT_THROW(make_qp_solver("osqp", settings), std::invalid_argument);
}

TEST(QpFactory, AnUnknownNameGetsTheListOfValidOnes) {
  try {
    make_qp_solver("qpoases");
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("'qpoases'"), std::string::npos);
    for (std::string_view name : qp_solver_names())
      EXPECT_NE(message.find(name), std::string::npos) << name;
  }
}

}  // namespace
}  // namespace palanquin
