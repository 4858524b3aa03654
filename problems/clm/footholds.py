"""Reference footholds after Raibert's heuristic, on ground of any slope.

M. Raibert, *Legged Robots That Balance*, 1986: a foot that lands half a stance ahead of its hip
leaves the body's velocity as it is, and lands further out when the body is too fast. On a slope the
hips are projected along gravity, not along the body's own vertical, so that the feet stay spread
evenly below the centre of mass. De Vincenti and Coros name this as an extension (section IV-C);
their own references are the hips' projections at each knot.
"""

from __future__ import annotations

import numpy as np

from palanquin import _core
from palanquin.problems.clm.team import Team
from palanquin.problems.terrains import Terrain

MOST_CORRECTION: float = _core.MOST_CORRECTION
"""How far a foothold gives way to a body that is too fast, m."""


def raibert_footholds(
    team: Team,
    robots: np.ndarray,
    terrain: Terrain,
    times: np.ndarray,
    stances: tuple[np.ndarray, np.ndarray],
    too_fast: np.ndarray,
) -> np.ndarray:
    """Footholds r_f* [N+1, R, 4, 3] relative to the robots' reference positions, world axes, m.

    A knot has the foothold of the stance that holds there or comes next: below where the hip will
    be in the middle of that stance, moved on by sqrt(h / g) times the excess of velocity if the
    stance is still to come (h is the standing height; the capture point of a pendulum).

    Args:
        team: payload and robots.
        robots: their reference states [N+1, R, 13].
        terrain: height map.
        times: of the knots, s, [N+1].
        stances: when they begin and end, s, each [N+1, R, 4].
        too_fast: measured less reference velocity, horizontal, world axes, m/s, [R, 2].
    """
    n, count = len(times), len(team.carriers)
    bodies = np.concatenate([np.zeros_like(robots[:, :1]), robots], axis=1).reshape(n, -1)
    begin, end = (part.reshape(n, -1) for part in stances)
    found = _core.raibert_footholds(
        team.core, terrain.core, bodies, list(times), begin, end, np.asarray(too_fast, dtype=float)
    )
    return found.reshape(n, count, 4, 3)
