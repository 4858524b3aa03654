#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "palanquin/solvers/qp_settings.hpp"
#include "palanquin/solvers/qp_solver.hpp"

namespace palanquin {

/// The names that make_qp_solver knows.
std::vector<std::string_view> qp_solver_names();

/// Makes the back end called `name`. Throws std::invalid_argument for a name that is not among
/// qp_solver_names() and for settings that explain_invalid() objects to.
std::unique_ptr<QpSolver> make_qp_solver(std::string_view name, const QpSettings& settings = {});

}  // namespace palanquin
