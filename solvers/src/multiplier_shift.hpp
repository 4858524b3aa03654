#pragma once

#include "palanquin/core/stage_qp.hpp"
#include "palanquin/core/trajectory.hpp"

namespace palanquin {

/// By how many knots (0 to 3) `guess` is ahead of the trajectory `last`: a planner shifts its last
/// plan by the time that has passed. The shift whose knots lie closest; the smallest of equal ones.
int find_shift(const RowMatrix& last, MatrixView guess);

/// Moves the hard rows' multipliers by `shift` knots towards the start of the horizon. The last
/// knots keep theirs; where a knot's rows are others than those moved there, resizing clears them.
void shift_multipliers(int shift, StageQpSolution& solution);

}  // namespace palanquin
