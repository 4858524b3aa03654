#pragma once

#include "palanquin/core/lowered_problem.hpp"
#include "palanquin/core/trajectory.hpp"

namespace palanquin {

/// The problem's own dynamics as a nominal plant: the next knot vector [nz] from `z` [nz] under
/// parameters `p` [np]. States move; other blocks keep their values.
/// Throws std::invalid_argument for wrong sizes.
Eigen::VectorXd step_dynamics(const LoweredProblem& problem, VectorView z, VectorView p);

}  // namespace palanquin
