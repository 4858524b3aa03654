#pragma once

#include "structured/workspace.hpp"

namespace palanquin::structured {

/// Steps (1) to (5) at `knot`, whose successor is factorised. Returns false if a pivot was not
/// positive enough or not a number.
bool factorize_knot(Workspace& workspace, const StageQp& qp, const PenaltyModel& model, int knot);

}  // namespace palanquin::structured
