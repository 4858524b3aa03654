#pragma once

#include <memory>

#include "palanquin/solvers/qp_solver.hpp"

namespace palanquin {

/// `solver` behind an EliminatedQp: it is handed QPs without what equality rows give.
std::unique_ptr<QpSolver> make_eliminating_qp_solver(std::unique_ptr<QpSolver> solver);

}  // namespace palanquin
