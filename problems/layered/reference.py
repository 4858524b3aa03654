"""What each robot of a team on bars is told to do, and the reference that follows from it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palanquin.problems.planning import Velocity

Array = NDArray[np.float64]

STANDING_HEIGHT = 0.26
"""Of the centre of mass over the ground, m (V-A.1)."""

YAW_LEASH = 0.3
"""Farthest that a reference's heading runs ahead of the robot's, rad."""


Leash = Callable[[float, float], tuple[float, float]]
"""How far ahead of its robot a reference (x, y) may be, m: held back or pushed away, a robot does
not have to make up for more.
"""


def within_circle(radius: float) -> Leash:
    """At most `radius` (m) in any direction."""

    def hold(x: float, y: float) -> tuple[float, float]:
        share = min(1.0, radius / max(math.hypot(x, y), 1e-9))
        return share * x, share * y

    return hold


def within_square(half: float) -> Leash:
    """At most `half` (m) along each axis of the world."""
    return lambda x, y: (min(max(x, -half), half), min(max(y, -half), half))


@dataclass
class Reference:
    """The state that one robot is to have now: centre of mass over the ground, level, on course.

    Attributes:
        position: m, world, [3].
        velocity: m/s, world, [3].
        leash: how far ahead of the robot it may run.
        yaw: rad.
        yaw_rate: rad/s.
    """

    position: Array
    velocity: Array
    leash: Leash
    yaw: float = 0.0
    yaw_rate: float = 0.0

    @classmethod
    def at(cls, body: Array, leash: Leash) -> Reference:
        """The reference of a robot in state `body` [13] that is to stay where it is."""
        return cls(body[:3].copy(), np.zeros(3), leash, heading(body))

    def copy(self) -> Reference:
        """As it is now."""
        return replace(self)

    def advance(self, command: Velocity, body: Array, ground: float, dt: float) -> None:
        """Moves on by `dt` (s) under a `command` in the reference's own heading.

        `body` [13] is the robot's state, `ground` the height below it, m.
        """
        cosine, sine = math.cos(self.yaw), math.sin(self.yaw)
        vx = cosine * command.vx - sine * command.vy
        vy = sine * command.vx + cosine * command.vy
        x, y = body[:2].tolist()
        ahead = self.leash(self.position[0] + dt * vx - x, self.position[1] + dt * vy - y)
        self.position = np.array([x + ahead[0], y + ahead[1], ground + STANDING_HEIGHT])
        self.velocity = np.array([vx, vy, 0.0])
        self.yaw_rate = command.wz
        now = heading(body)
        turn = math.remainder(self.yaw + dt * command.wz - now, 2 * math.pi)
        self.yaw = now + min(max(turn, -YAW_LEASH), YAW_LEASH)

    @property
    def rotation(self) -> list[list[float]]:
        """About z, body to world, [3][3]."""
        cosine, sine = math.cos(self.yaw), math.sin(self.yaw)
        return [[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]]

    @property
    def body(self) -> Array:
        """As a state [13]: position, orientation (w, x, y, z), velocity, angular velocity."""
        turn = (math.cos(self.yaw / 2), 0.0, 0.0, math.sin(self.yaw / 2))
        return np.array([*self.position, *turn, *self.velocity, 0.0, 0.0, self.yaw_rate])


def heading(body: Array) -> float:
    """Yaw of a robot's x axis in the world, rad."""
    w, x, y, z = body[3:7].tolist()
    return math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))
