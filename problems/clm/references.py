"""Reference motions (III-C of De Vincenti and Coros): payload, robots, footholds.

States of a body are [13]: position (world, m), orientation (w, x, y, z, body to world), velocity
(world, m/s), angular velocity (body, rad/s). Bodies are ordered payload, robots.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from palanquin import _core
from palanquin.errors import ProblemError
from palanquin.problems import checks
from palanquin.problems.clm.team import Team
from palanquin.problems.planning import Velocity
from palanquin.problems.terrains import Terrain

STATE = 13
POSITION, ORIENTATION = slice(0, 3), slice(3, 7)
VELOCITY, ANGULAR_VELOCITY = slice(7, 10), slice(10, 13)
PARTS = {
    "position": POSITION,
    "orientation": ORIENTATION,
    "velocity": VELOCITY,
    "angular_velocity": ANGULAR_VELOCITY,
}


RobotReferences = Literal["rigid", "ground"]
"""How robots' references follow from the payload's: as one rigid body with it, which is (14) of the
paper, or each over the ground below itself, within the reach of its legs."""


@dataclass(frozen=True)
class References:
    """Reference motion over a horizon.

    Attributes:
        bodies: states [N+1, R+1, 13].
        footholds: r_f*, relative to the robot's reference position, world axes, m, [N+1, R, 4, 3].
    """

    bodies: np.ndarray
    footholds: np.ndarray

    @staticmethod
    def of(bodies: np.ndarray, footholds: np.ndarray) -> References:
        """From the engine's arrays [N+1, 13 (R+1)] and [N+1, 12 R]."""
        n = len(bodies)
        return References(bodies.reshape(n, -1, STATE), footholds.reshape(n, -1, 4, 3))

    def feet(self) -> np.ndarray:
        """Reference footholds in the world, m, [N+1, R, 4, 3]."""
        return np.add(self.bodies[:, 1:, None, POSITION], self.footholds)


def make_references(
    team: Team,
    terrain: Terrain,
    start: np.ndarray,
    command: Velocity,
    horizon: int,
    dt: float,
    robots: RobotReferences = "rigid",
) -> References:
    """References of all bodies and feet.

    Args:
        team: payload and robots.
        terrain: height map.
        start: reference (x, y, yaw) of the payload at knot 0, m and rad, [3].
        command: velocity command, constant over the horizon.
        horizon: number N of intervals.
        dt: their length, s.
        robots: how their references follow from the payload's.
    """
    if robots not in get_args(RobotReferences):
        known = ", ".join(get_args(RobotReferences))
        raise ProblemError(f"references of robots are {robots!r}; they must be one of {known}")
    bodies, footholds = _core.make_references(
        team.core,
        terrain.core,
        checks.array("start", start, 3),
        command.core,
        horizon,
        dt,
        robots == "ground",
    )
    return References.of(bodies, footholds)


def payload_path(
    terrain: Terrain, start: np.ndarray, command: Velocity, horizon: int, dt: float
) -> np.ndarray:
    """The payload's poses (x, y, yaw), m and rad, at the knots 0..horizon, [horizon + 1, 3].

    Explicit Euler steps of the velocity tilted onto the ground, from `start` [3] on.
    """
    at = checks.array("start", start, 3)
    return _core.payload_path(terrain.core, at, command.core, horizon + 1, dt)


def nominal_state(
    team: Team, terrain: Terrain, start: np.ndarray, robots: RobotReferences = "rigid"
) -> tuple[np.ndarray, np.ndarray]:
    """Standing still at payload pose (x, y, yaw): states [R+1, 13], feet in the world [R, 4, 3]."""
    references = make_references(team, terrain, start, Velocity(), 0, 1.0, robots)
    return references.bodies[0], references.feet()[0]
