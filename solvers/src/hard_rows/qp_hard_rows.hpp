#pragma once

#include <memory>

#include "palanquin/solvers/qp_settings.hpp"
#include "palanquin/solvers/qp_solver.hpp"

namespace palanquin {

/// The back end "structured": StructuredQpSolver, around it two methods for hard inequality rows
/// that share its Riccati recursion.
///
///   1. MultiplierMethod from the warm start's multipliers, for some recursions: most QPs of a
///      running planner need one or two.
///   2. InteriorPoint from cold, whose effort does not depend on how many rows change; its active
///      set then goes to (1), which makes it exact.
///   3. What has no interior, or is infeasible: MultiplierMethod from cold to the end.
///
/// Infeasible is said with a certificate only. A failed solve leaves nothing behind that the next
/// one starts from. Takes no link rows.
std::unique_ptr<QpSolver> make_structured_qp_solver(const MultipliersSettings& settings,
                                                    const StructuredQpSettings& structured);

}  // namespace palanquin
