"""Reference motions (III-C of De Vincenti and Coros): payload, robots, footholds.

States of a body are [13]: position (world, m), orientation (w, x, y, z, body to world), velocity
(world, m/s), angular velocity (body, rad/s). Bodies are ordered payload, robots.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from palanquin.errors import ProblemError
from palanquin.problems import checks, quaternions
from palanquin.problems.clm.ground_following import follow_ground
from palanquin.problems.clm.team import Team
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
paper, or each over its own ground, see `follow_ground`."""


@dataclass(frozen=True)
class Velocity:
    """Planar velocity command in the payload's heading frame.

    Attributes:
        vx: forward, m/s.
        vy: to the left, m/s.
        wz: yaw rate, rad/s.
    """

    vx: float = 0.0
    vy: float = 0.0
    wz: float = 0.0

    def __post_init__(self) -> None:
        for name in ("vx", "vy", "wz"):
            checks.finite(f"command.{name}", getattr(self, name))


@dataclass(frozen=True)
class References:
    """Reference motion over a horizon.

    Attributes:
        bodies: states [N+1, R+1, 13].
        footholds: r_f*, relative to the robot's reference position, world axes, m, [N+1, R, 4, 3].
    """

    bodies: np.ndarray
    footholds: np.ndarray

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
    trend = terrain.trend
    path = payload_path(trend, start, command, horizon + 1, dt)
    bodies = rigid_motion(team, trend, path, command)
    if robots == "ground" and not trend.is_plane:
        _put_on_own_ground(team, trend, bodies, path, dt)
    bodies = bodies[:-1]
    return References(bodies, foothold_references(team, bodies[:, 1:], terrain))


@dataclass(frozen=True)
class PayloadPath:
    """The payload's way over the ground: `pose` (x, y, yaw) [n, 3], m and rad, and the ground's
    `slope` (dz/dx, dz/dy) below it [n, 2].
    """

    pose: np.ndarray
    slope: np.ndarray


def payload_path(
    terrain: Terrain, start: np.ndarray, command: Velocity, horizon: int, dt: float
) -> PayloadPath:
    """The payload's path at the knots 0..horizon that starts at (x, y, yaw) [3], m and rad.

    Explicit Euler steps of the velocity tilted onto the ground. The smallest rotation that takes
    the z axis to the normal (-s, 1) / l of a ground of slope s takes a horizontal vector c to one
    whose horizontal part is c - (s . c) s / (l (1 + l)).
    """
    path = np.empty((horizon + 1, 5))
    x, y, yaw = checks.array("start", start, 3).tolist()
    for knot in path:
        sx, sy = terrain.slope(x, y)
        knot[:] = x, y, yaw, sx, sy
        cos, sin = math.cos(yaw), math.sin(yaw)
        cx, cy = cos * command.vx - sin * command.vy, sin * command.vx + cos * command.vy
        length = math.sqrt(1 + sx * sx + sy * sy)
        along = (sx * cx + sy * cy) / (length * (1 + length))
        x, y, yaw = x + dt * (cx - along * sx), y + dt * (cy - along * sy), yaw + dt * command.wz
    return PayloadPath(path[:, :3], path[:, 3:])


def rigid_motion(team: Team, terrain: Terrain, path: PayloadPath, command: Velocity) -> np.ndarray:
    """States [n, R+1, 13] of payload and robots that move along the path as one rigid body (14).

    The payload's heading frame is tilted onto the ground below it, over which it keeps its height.
    As printed, (14b) adds the world velocity of the hand to a vector of mixed frames. The rigid
    motion that the text describes is v_i* = v_0* + (q_0* Omega_0*) x (p_i* - p_0*).
    """
    offsets, turns = team.formation.offsets, team.formation.turns
    x, y, yaw = path.pose.T
    orientation = quaternions.on_slope(path.slope, yaw)
    to_world = quaternions.matrix(orientation).swapaxes(-1, -2)
    # In the payload's frame, of which the command gives the velocity: (vx, vy, 0) + wz z x offset.
    velocities = np.zeros((len(offsets) + 1, 3))
    velocities[1:, 0], velocities[1:, 1] = -command.wz * offsets[:, 1], command.wz * offsets[:, 0]
    velocities[:, :2] += command.vx, command.vy
    states = np.zeros((len(path.pose), len(offsets) + 1, STATE))
    states[..., 0], states[..., 1] = x[:, None], y[:, None]
    states[..., 2] = (terrain.height(x, y) + team.payload.height)[:, None]
    states[:, 1:, POSITION] += offsets @ to_world  # (14a)
    states[:, 0, ORIENTATION] = orientation
    states[:, 1:, ORIENTATION] = quaternions.multiply(orientation[:, None], turns)
    states[..., VELOCITY] = velocities @ to_world  # (14b)
    states[..., 12] = command.wz  # (14c): robots are turned about the payload's z axis only
    return states


def _put_on_own_ground(
    team: Team, terrain: Terrain, bodies: np.ndarray, path: PayloadPath, dt: float
) -> None:
    """Moves the robots among the states [n, R+1, 13] by `follow_ground`; their velocities take them
    from each knot to the next. The last one's stay.
    """
    robots = bodies[:, 1:]
    position, orientation = follow_ground(
        team, terrain, robots[..., POSITION], robots[..., ORIENTATION], path.pose[:, 2]
    )
    turned = quaternions.multiply(quaternions.conjugate(orientation[:-1]), orientation[1:])
    robots[..., POSITION], robots[..., ORIENTATION] = position, orientation
    robots[:-1, :, VELOCITY] = np.diff(position, axis=0) / dt
    robots[:-1, :, ANGULAR_VELOCITY] = quaternions.rotation_vector(turned) / dt


def foothold_references(team: Team, robots: np.ndarray, terrain: Terrain) -> np.ndarray:
    """Footholds r_f* [N+1, R, 4, 3]: hips of the reference pose, projected down to the ground."""
    axes = quaternions.matrix(robots[..., ORIENTATION])
    footholds = team.formation.hips @ axes.swapaxes(-1, -2)
    hips = robots[..., None, POSITION] + footholds
    footholds[..., 2] = terrain.height(hips[..., 0], hips[..., 1]) - robots[..., None, 2]
    return footholds


def nominal_state(
    team: Team, terrain: Terrain, start: np.ndarray, robots: RobotReferences = "rigid"
) -> tuple[np.ndarray, np.ndarray]:
    """Standing still at payload pose (x, y, yaw): states [R+1, 13], feet in the world [R, 4, 3]."""
    references = make_references(team, terrain, start, Velocity(), 0, 1.0, robots)
    return references.bodies[0], references.feet()[0]
