"""What each robot of a team is told to do: a velocity, and the reference that follows from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palanquin import _sim
from palanquin.problems import quaternions
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
        cosine, sine = np.cos(self.yaw), np.sin(self.yaw)
        self.velocity = np.array(
            [cosine * command.vx - sine * command.vy, sine * command.vx + cosine * command.vy, 0.0]
        )
        self.yaw_rate = command.wz
        self.position = self.position + dt * self.velocity
        self.position[2] = seen.ground + STANDING_HEIGHT
        ahead = self.position[:2] - seen.position[:2]
        if (distance := float(np.linalg.norm(ahead))) > LEASH:
            self.position[:2] = seen.position[:2] + ahead * LEASH / distance
        turn = _wrapped(self.yaw + dt * command.wz - heading(seen))
        self.yaw = heading(seen) + float(np.clip(turn, -YAW_LEASH, YAW_LEASH))

    @property
    def body(self) -> Array:
        """As a state [13]: position, orientation (w, x, y, z), velocity, angular velocity."""
        turn = quaternions.from_yaw(self.yaw)
        return np.concatenate([self.position, turn, self.velocity, [0.0, 0.0, self.yaw_rate]])


def heading(seen: _sim.RobotObservation) -> float:
    """Yaw of a robot in the world, rad."""
    return float(quaternions.yaw_of(np.array(seen.orientation)))


def _wrapped(angle: float) -> float:
    return float((angle + np.pi) % (2 * np.pi) - np.pi)
