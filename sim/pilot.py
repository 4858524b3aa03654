"""Directs a team by key presses: velocities in steps, gaits, stop, pushes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from palanquin.problems.clm.references import Velocity
from palanquin.sim.scenarios.disturbance import Push
from palanquin.sim.scenarios.gait import GaitChange, GaitChoice
from palanquin.sim.scenarios.script import Orders

GAITS = ("stand", "trot", "pace", "bound", "pronk", "crawl")

# Key: (component of (vx, vy, wz), step in m/s or rad/s).
_STEPS = {
    "up": (0, 0.05),
    "down": (0, -0.05),
    "a": (1, 0.05),
    "d": (1, -0.05),
    "left": (2, 0.05),
    "right": (2, -0.05),
}
_LIMITS = np.array([0.8, 0.4, 0.5])

_PUSH_FORCE = {"p": 100.0, "o": -100.0}
_PUSH_DURATION = 0.3

KEYS = (
    ("up, down", "faster, slower"),
    ("left, right", "turn"),
    ("a, d", "sideways"),
    ("space", "stop"),
    ("1 to 6", ", ".join(GAITS)),
    ("tab", "whom to push"),
    ("p, o", "push to the left, right"),
    ("q", "quit"),
)
"""What each key does, for a screen."""


class Pilot:
    """A director that key presses steer; orders hold from the next tick on.

    Args:
        bodies: names of the bodies that can be pushed, the payload first.
        gait: name of the gait that everybody starts with.
    """

    def __init__(self, bodies: Sequence[str], gait: str) -> None:
        self._bodies = tuple(bodies)
        self.gait = gait
        self.target = self._bodies[-1]
        self.note = ""
        self.has_quit = False
        self._velocity = np.zeros(3)
        self._gait_orders: list[str] = []
        self._push_orders: list[float] = []
        self._pushes: tuple[Push, ...] = ()

    @property
    def velocity(self) -> Velocity:
        """The velocity that is ordered now."""
        vx, vy, wz = (float(part) for part in self._velocity)
        return Velocity(vx, vy, wz)

    def press(self, key: str) -> None:
        """Takes a key: "up", "down", "left", "right", "space", "tab", or a character."""
        self.note = ""
        if key in _STEPS:
            self._change_velocity(*_STEPS[key])
        elif key == "space":
            self._velocity[:] = 0.0
        elif key.isdecimal() and 1 <= int(key) <= len(GAITS):
            self._change_gait(GAITS[int(key) - 1])
        elif key == "tab":
            self.target = self._bodies[(self._bodies.index(self.target) + 1) % len(self._bodies)]
        elif key in _PUSH_FORCE:
            self._push_orders.append(_PUSH_FORCE[key])
            self.note = f"{self.target} is pushed with {abs(_PUSH_FORCE[key]):.0f} N"
        elif key == "q":
            self.has_quit = True

    def at(self, time: float, pose: NDArray[np.float64], period: float) -> Orders:
        """As of `Director`: what was pressed since the last tick begins now."""
        changes = tuple(
            GaitChange(time=time, gait=GaitChoice(name=gait)) for gait in self._gait_orders
        )
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        self._pushes += tuple(
            Push(
                body=self.target,
                force=(float(-sin * force), float(cos * force), 0.0),
                start=time,
                duration=_PUSH_DURATION,
            )
            for force in self._push_orders
        )
        self._gait_orders, self._push_orders = [], []
        return Orders((self.velocity,), changes, self._pushes)

    def _change_velocity(self, component: int, step: float) -> None:
        if self.gait == "stand":
            self.note = "standing: choose a gait first (2 to 6)"
            return
        wanted = np.round(self._velocity[component] + step, 3)
        limit = _LIMITS[component]
        self._velocity[component] = np.clip(wanted, -limit, limit)

    def _change_gait(self, gait: str) -> None:
        # Feet that never move cannot follow a velocity.
        if gait == "stand":
            self._velocity[:] = 0.0
        self.gait = gait
        self._gait_orders.append(gait)
