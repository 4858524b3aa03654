#pragma once

#include "structured/workspace.hpp"

namespace palanquin::structured {

/// Steps (1) to (5) at `knot`, whose successor is factorised. Returns false if a pivot was not
/// positive enough or not a number.
bool factorize_knot(Workspace& workspace, const StageQp& qp, const PenaltyModel& model, int knot);

/// Step (4): eliminates the locals from the knot's G. Returns false for a bad pivot.
bool eliminate_locals(const Knot& knot, double pivot_tolerance);

}  // namespace palanquin::structured
