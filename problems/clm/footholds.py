"""Reference footholds after Raibert's heuristic, on ground of any slope.

M. Raibert, *Legged Robots That Balance*, 1986: a foot that lands half a stance ahead of its hip
leaves the body's velocity as it is, and lands further out when the body is too fast. On a slope the
hips are projected along gravity, not along the body's own vertical, so that the feet stay spread
evenly below the centre of mass. De Vincenti and Coros name this as an extension (section IV-C);
their own references are the hips' projections at each knot.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palanquin.problems import quaternions
from palanquin.problems.clm.references import (
    ANGULAR_VELOCITY,
    ORIENTATION,
    POSITION,
    VELOCITY,
    References,
)
from palanquin.problems.clm.team import Team
from palanquin.problems.gaits import GaitClock
from palanquin.problems.modules.rigid_body import GRAVITY
from palanquin.problems.terrains import Terrain

MOST_CORRECTION = 0.1
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
    begin, end = stances
    position, orientation = robots[..., None, POSITION], robots[..., None, ORIENTATION]
    hips = quaternions.rotate(orientation, team.hips())
    spin = quaternions.rotate(orientation, robots[..., None, ANGULAR_VELOCITY])
    velocity = robots[..., None, VELOCITY] + quaternions.cross(spin, hips)
    to_middle = (begin + end) / 2 - times[:, None, None]
    feet = position + hips + to_middle[..., None] * velocity
    heights = np.array([carrier.model.standing_height for carrier in team.carriers])
    correction = np.sqrt(heights / -GRAVITY[2])[:, None] * too_fast
    correction = np.clip(correction, -MOST_CORRECTION, MOST_CORRECTION)
    feet[..., :2] += np.where((begin > times[0])[..., None], correction[:, None], 0.0)
    feet[..., 2] = terrain.height(feet[..., 0], feet[..., 1])
    return feet - position


def with_raibert_footholds(
    references: References,
    team: Team,
    terrain: Terrain,
    times: np.ndarray,
    clocks: Sequence[GaitClock],
    measured: np.ndarray,
) -> References:
    """The references with `raibert_footholds` for robots on these gait clocks.

    Args:
        references: of the horizon.
        team: payload and robots.
        terrain: height map.
        times: of the knots, s, [N+1].
        clocks: the robots' gaits, R of them.
        measured: the robots' states [R, 13] at the first knot.
    """
    robots = references.bodies[:, 1:]
    begin, end = zip(*(clock.stances(times) for clock in clocks), strict=True)
    stances = np.stack(begin, axis=1), np.stack(end, axis=1)
    too_fast = (measured[:, VELOCITY] - robots[0, :, VELOCITY])[:, :2]
    footholds = raibert_footholds(team, robots, terrain, times, stances, too_fast)
    return References(references.bodies, footholds)
