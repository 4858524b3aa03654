"""Reference motions (III-C of De Vincenti and Coros): payload, robots, footholds.

States of a body are [13]: position (world, m), orientation (w, x, y, z, body to world), velocity
(world, m/s), angular velocity (body, rad/s). Bodies are ordered payload, robots.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palanquin.problems import checks, quaternions
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
) -> References:
    """References of all bodies and feet.

    Args:
        team: payload and robots.
        terrain: height map.
        start: reference (x, y, yaw) of the payload at knot 0, m and rad, [3].
        command: velocity command, constant over the horizon.
        horizon: number N of intervals.
        dt: their length, s.
    """
    payload = payload_reference(terrain, team.payload.height, start, command, horizon, dt)
    robots = robot_references(team, payload)
    return References(
        bodies=np.concatenate([payload[:, None], robots], axis=1),
        footholds=foothold_references(team, robots, terrain),
    )


def payload_reference(
    terrain: Terrain,
    height: float,
    start: np.ndarray,
    command: Velocity,
    horizon: int,
    dt: float,
) -> np.ndarray:
    """Payload states [N+1, 13]: a planar command followed along the ground.

    The heading frame is tilted onto the tangent plane below the payload, and z is `height` over
    the ground.
    """
    path = payload_path(terrain, start, command, horizon, dt)
    x, y, yaw = path.T
    tilt = quaternions.tilt_to(terrain.normal(x, y))
    states = np.zeros((horizon + 1, STATE))
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
        sx, sy = terrain.gradient(x, y)
        length = math.sqrt(1 + sx * sx + sy * sy)
        along = (sx * cx + sy * cy) / (length * (1 + length))
        x, y, yaw = x + dt * (cx - along * sx), y + dt * (cy - along * sy), yaw + dt * command.wz
    return path


def robot_references(team: Team, payload: np.ndarray) -> np.ndarray:
    """Robots' states [N+1, R, 13] as if all were one rigid body with the payload (14).

    As printed, (14b) adds the world velocity of the hand to a vector of mixed frames. The rigid
    motion that the text describes is v_i* = v_0* + (q_0* Omega_0*) x (p_i* - p_0*).
    """
    payload = payload[:, None]
    yaw = quaternions.from_yaw(np.array([carrier.yaw for carrier in team.carriers]))
    orientation = quaternions.multiply(payload[..., ORIENTATION], yaw)
    grasp = quaternions.rotate(payload[..., ORIENTATION], team.attach())
    from_payload = grasp - quaternions.rotate(orientation, team.hands())
    spin = quaternions.rotate(payload[..., ORIENTATION], payload[..., ANGULAR_VELOCITY])
    position = payload[..., POSITION] + from_payload  # (14a)
    velocity = payload[..., VELOCITY] + quaternions.cross(spin, from_payload)  # (14b), mended
    angular_velocity = quaternions.rotate_inverse(orientation, spin)  # (14c)
    return np.concatenate([position, orientation, velocity, angular_velocity], axis=-1)


def foothold_references(team: Team, robots: np.ndarray, terrain: Terrain) -> np.ndarray:
    """Footholds r_f* [N+1, R, 4, 3]: hips of the reference pose, projected down to the ground."""
    footholds = quaternions.rotate(robots[..., None, ORIENTATION], team.hips())
    hips = robots[..., None, POSITION] + footholds
    footholds[..., 2] = terrain.height(hips[..., 0], hips[..., 1]) - robots[..., None, 2]
    return footholds


def nominal_state(team: Team, terrain: Terrain, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Standing still at payload pose (x, y, yaw): states [R+1, 13], feet in the world [R, 4, 3]."""
    references = make_references(team, terrain, start, Velocity(), horizon=0, dt=1.0)
    return references.bodies[0], references.feet()[0]
