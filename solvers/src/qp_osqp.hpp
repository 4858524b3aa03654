#pragma once

#include <memory>

#include "palanquin/solvers/qp_settings.hpp"
#include "palanquin/solvers/qp_solver.hpp"

namespace palanquin {

/// The back end "osqp": operator splitting (Stellato et al. 2020). Takes every kind of row.
std::unique_ptr<QpSolver> make_osqp_qp_solver(const OsqpSettings& settings);

}  // namespace palanquin
