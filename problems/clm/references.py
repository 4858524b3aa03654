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
    path = payload_path(terrain, start, command, horizon + 1, dt)
    payload = payload_reference(terrain, team.payload.height, path, command)
    states = robot_references(team, payload)
    if robots == "ground" and not terrain.is_plane:
        states = _over_own_ground(team, terrain, states, path[:, 2], dt)
    payload, states = payload[:-1], states[:-1]
    return References(
        bodies=np.concatenate([payload[:, None], states], axis=1),
        footholds=foothold_references(team, states, terrain),
    )


def payload_reference(
    terrain: Terrain, height: float, path: np.ndarray, command: Velocity
) -> np.ndarray:
    """Payload states [n, 13] along a path of (x, y, yaw) [n, 3] that follows a planar command.

    The heading frame is tilted onto the tangent plane below the payload, and z is `height` over
    the ground.
    """
    x, y, yaw = path.T
    tilt = quaternions.tilt_to(terrain.normal(x, y))
    states = np.zeros((len(path), STATE))
    states[:, 0], states[:, 1], states[:, 2] = x, y, terrain.height(x, y) + height
    states[:, ORIENTATION] = quaternions.multiply(tilt, quaternions.from_yaw(yaw))
    planar = np.array([command.vx, command.vy, 0.0])
    states[:, VELOCITY] = quaternions.rotate(states[:, ORIENTATION], planar)
    states[:, 12] = command.wz
    return states


def payload_path(
    terrain: Terrain, start: np.ndarray, command: Velocity, horizon: int, dt: float
) -> np.ndarray:
    """(x, y, yaw) of the payload at the knots, m and rad, [N+1, 3].

    Explicit Euler steps of the velocity tilted onto the ground. The smallest rotation that takes
    the z axis to the normal (-s, 1) / l of a ground of slope s takes a horizontal vector c to one
    whose horizontal part is c - (s . c) s / (l (1 + l)).
    """
    path = np.empty((horizon + 1, 3))
    x, y, yaw = checks.array("start", start, 3).tolist()
    for knot in path:
        knot[:] = x, y, yaw
        cos, sin = math.cos(yaw), math.sin(yaw)
        cx, cy = cos * command.vx - sin * command.vy, sin * command.vx + cos * command.vy
        sx, sy = terrain.slope(x, y)
        length = math.sqrt(1 + sx * sx + sy * sy)
        along = (sx * cx + sy * cy) / (length * (1 + length))
        x, y, yaw = x + dt * (cx - along * sx), y + dt * (cy - along * sy), yaw + dt * command.wz
    return path


def robot_references(team: Team, payload: np.ndarray) -> np.ndarray:
    """Robots' states [N+1, R, 13] as if all were one rigid body with the payload (14).

    As printed, (14b) adds the world velocity of the hand to a vector of mixed frames. The rigid
    motion that the text describes is v_i* = v_0* + (q_0* Omega_0*) x (p_i* - p_0*).
    """
    formation = team.formation
    axes = quaternions.matrix(payload[:, ORIENTATION])
    from_payload = formation.offsets @ axes.swapaxes(-1, -2)
    spin = (axes @ payload[:, ANGULAR_VELOCITY, None]).swapaxes(-1, -2)
    payload = payload[:, None]
    states = np.empty((len(payload), len(team.carriers), STATE))
    states[..., POSITION] = payload[..., POSITION] + from_payload  # (14a)
    states[..., ORIENTATION] = quaternions.multiply(payload[..., ORIENTATION], formation.turns)
    states[..., VELOCITY] = payload[..., VELOCITY] + quaternions.cross(spin, from_payload)  # (14b)
    states[..., ANGULAR_VELOCITY] = quaternions.rotate_inverse(  # (14c)
        formation.turns, payload[..., ANGULAR_VELOCITY]
    )
    return states


def _over_own_ground(
    team: Team, terrain: Terrain, robots: np.ndarray, yaw: np.ndarray, dt: float
) -> np.ndarray:
    """Robots' states [n, R, 13] moved by `follow_ground`; velocities take each to the next knot.

    The last knot has no next one, and keeps its velocities.
    """
    position, orientation = follow_ground(
        team, terrain, robots[..., POSITION], robots[..., ORIENTATION], yaw
    )
    turned = quaternions.multiply(quaternions.conjugate(orientation[:-1]), orientation[1:])
    moved = robots.copy()
    moved[..., POSITION], moved[..., ORIENTATION] = position, orientation
    moved[:-1, :, VELOCITY] = np.diff(position, axis=0) / dt
    moved[:-1, :, ANGULAR_VELOCITY] = quaternions.rotation_vector(turned) / dt
    return moved


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
