"""What each robot of a team is told to do: a velocity, and the reference that follows from it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palanquin import _sim
from palanquin.problems.clm.references import Velocity
from palanquin.sim.bar.team import STANDING_HEIGHT

Array = NDArray[np.float64]

LEASH = 0.15
"""Farthest that a robot's reference runs ahead of it horizontally, m: held back or pushed away, it
does not have to make up for more.
"""

YAW_LEASH = 0.3
"""The same for the heading, rad."""


@dataclass
class Reference:
    """The state that one robot is to have now: centre of mass over the ground, level, on course.

    Attributes:
        position: m, world, [3].
        velocity: m/s, world, [3].
        yaw: rad.
        yaw_rate: rad/s.
    """

    position: Array
    velocity: Array
    yaw: float = 0.0
    yaw_rate: float = 0.0

    @classmethod
    def at(cls, seen: _sim.RobotObservation) -> Reference:
        """The reference of a robot that is to stay where it is."""
        return cls(np.array(seen.position), np.zeros(3), heading(seen))

    def advance(self, command: Velocity, seen: _sim.RobotObservation, dt: float) -> None:
        """Moves on by `dt` (s) under a `command` in the reference's own heading."""
        cosine, sine = math.cos(self.yaw), math.sin(self.yaw)
        vx = cosine * command.vx - sine * command.vy
        vy = sine * command.vx + cosine * command.vy
        x, y, _ = seen.position.tolist()
        ahead = (self.position[0] + dt * vx - x, self.position[1] + dt * vy - y)
        share = min(1.0, LEASH / max(math.hypot(*ahead), 1e-9))
        height = seen.ground + STANDING_HEIGHT
        self.position = np.array([x + share * ahead[0], y + share * ahead[1], height])
        self.velocity = np.array([vx, vy, 0.0])
        self.yaw_rate = command.wz
        now = heading(seen)
        turn = math.remainder(self.yaw + dt * command.wz - now, 2 * math.pi)
        self.yaw = now + min(max(turn, -YAW_LEASH), YAW_LEASH)

    @property
    def body(self) -> Array:
        """As a state [13]: position, orientation (w, x, y, z), velocity, angular velocity."""
        turn = (math.cos(self.yaw / 2), 0.0, 0.0, math.sin(self.yaw / 2))
        return np.array([*self.position, *turn, *self.velocity, 0.0, 0.0, self.yaw_rate])


def heading(seen: _sim.RobotObservation) -> float:
    """Yaw of a robot's x axis in the world, rad."""
    w, x, y, z = seen.orientation.tolist()
    return math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))
