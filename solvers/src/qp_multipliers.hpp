#pragma once

#include <memory>

#include "palanquin/solvers/qp_settings.hpp"
#include "palanquin/solvers/qp_solver.hpp"

namespace palanquin {

/// The back end "multipliers": the structured solver for problems with hard inequality rows, by the
/// method of multipliers with semismooth Newton steps (Li, Sun and Toh 2018; Bambade et al. 2022).
///
///   1. Minimise the augmented Lagrangian of HardRows. On an active set it is a QP without hard
///      rows, one Riccati recursion; its minimiser gives the next active set, by a line search from
///      the second step on, until the set stays.
///   2. nu = max(0, nu + rho h). If the rows hold to the tolerance, done; if they hardly improved,
///      rho grows; if they do not improve with rho at its limit, they contradict each other.
///
/// Most QPs of a running planner need one recursion: the active set is that of the multipliers in
/// the warm start. Takes no link rows.
std::unique_ptr<QpSolver> make_multipliers_qp_solver(const MultipliersSettings& settings,
                                                     const StructuredQpSettings& structured);

}  // namespace palanquin
