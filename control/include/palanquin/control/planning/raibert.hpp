#pragma once

#include <vector>

#include "palanquin/control/planning/references.hpp"

namespace palanquin::planning {

/// How far a foothold gives way to a body that is too fast, m.
constexpr double kMostCorrection = 0.1;

/// Reference footholds after Raibert's heuristic, on ground of any slope (M. Raibert, Legged Robots
/// That Balance, 1986; an extension that De Vincenti and Coros name in IV-C).
///
/// A knot has the foothold of the stance that holds there or comes next: below where the hip will
/// be in the middle of that stance, moved on by sqrt(h / g) times the excess of velocity if the
/// stance is still to come (h is the standing height; the capture point of a pendulum).
///
/// `times` [N + 1] of the knots, s; `stances` [R] at each of them; `too_fast` [R]: measured less
/// reference velocity, horizontal, world axes, m/s. Rewrites the footholds of `references`.
void use_raibert_footholds(const Team& team, const Terrain& terrain,
                           const std::vector<double>& times,
                           const std::vector<std::vector<Stances>>& stances,
                           const std::vector<Vector2>& too_fast, References& references);

}  // namespace palanquin::planning
