#pragma once

#include "structured/workspace.hpp"

namespace palanquin::structured {

/// Makes the equality rows exact. The factors hold them as quadratic rows of stiffness rho; a
/// proximal method of multipliers, which is iterative refinement with those factors, moves their
/// multipliers mu, and those of the dynamics. Starts from roll_out's point.
QpStatus refine_equality_rows(Workspace& workspace, const StageQp& qp);

}  // namespace palanquin::structured
