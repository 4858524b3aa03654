"""Does the way lead through obstacles?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from palanquin.problems import quaternions
from palanquin.problems.modules.obstacles import beam_volume, trunk_volume
from palanquin.sim.feasibility.finding import Finding, doubt
from palanquin.sim.scenarios.route import payload_route
from palanquin.sim.scenarios.scenario import Scenario

_SAMPLES = 31  # along each body


def obstacles_beside_the_way(scenario: Scenario) -> Iterator[Finding]:
    """No body begins in an obstacle, and none is told to go through one.

    Bodies are as the planner sees them, in the payload's reference pose and formation; what only
    comes near is left to the planner.
    """
    if not scenario.obstacles:
        return
    points, radii = _team_points(scenario)
    x, y, yaw = payload_route(scenario).T[:, :, None]
    cos, sin = np.cos(yaw), np.sin(yaw)
    along = x + cos * points[:, 0] - sin * points[:, 1]
    across = y + sin * points[:, 0] + cos * points[:, 1]
    for j, obstacle in enumerate(scenario.obstacles):
        depth = radii - distances(np.array(obstacle.row()), along, across)
        where = ("obstacles", j)
        if depth[0].max() > 0:
            yield Finding(where, f"the team begins {100 * depth[0].max():.0f} cm inside of it")
        elif depth.max() > 0:
            yield doubt(
                where,
                f"the commanded way leads {100 * depth.max():.0f} cm into it: the team will be "
                "held up or pushed aside",
            )


def _team_points(scenario: Scenario) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points [n, 2] of the bodies' axes in the payload's frame and radii around them [n], m."""
    formation = scenario.team.formation
    volumes = [beam_volume(scenario.payload.shape.extents)]
    volumes += [trunk_volume(carrier.model) for carrier in scenario.team.carriers]
    places = [np.zeros(3), *formation.offsets]
    turns = [np.array([1.0, 0, 0, 0]), *formation.turns]
    share = np.linspace(0, 1, _SAMPLES)[:, None]
    points = [
        place + quaternions.rotate(turn, (1 - share) * volume[:3] + share * volume[3:6])
        for place, turn, volume in zip(places, turns, volumes, strict=True)
    ]
    radii = np.repeat([volume[6] for volume in volumes], _SAMPLES)
    return np.concatenate(points)[:, :2], radii


def distances(
    row: NDArray[np.float64], x: NDArray[np.float64], y: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Signed distances of points from an obstacle, seen from above, m."""
    cos, sin = np.cos(row[2]), np.sin(row[2])
    dx, dy = x - row[0], y - row[1]
    across = np.abs(cos * dx + sin * dy) - row[3], np.abs(cos * dy - sin * dx) - row[4]
    outside = np.hypot(*(np.maximum(side, 0.0) for side in across))
    inside = np.minimum(np.maximum(*across), 0.0)
    return np.asarray(outside + inside - row[5])
