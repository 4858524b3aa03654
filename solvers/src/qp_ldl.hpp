#pragma once

#include <memory>

#include "palanquin/solvers/qp_settings.hpp"
#include "palanquin/solvers/qp_solver.hpp"

namespace palanquin {

/// The back end "ldl": a sparse direct factorisation of the whole KKT system. Takes equality and
/// link rows; with hard inequality rows it answers Unsupported.
std::unique_ptr<QpSolver> make_ldl_qp_solver(const LdlSettings& settings);

}  // namespace palanquin
