"""Directs a team by key presses: velocities in steps, gaits, stop, pushes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from palanquin.problems.planning import Velocity
from palanquin.sim.scenarios.bars import BarScenario
from palanquin.sim.scenarios.disturbance import Push
from palanquin.sim.scenarios.files import AnyScenario
from palanquin.sim.scenarios.gait import GaitChange, GaitChoice
from palanquin.sim.scenarios.script import Orders

GAITS = ("stand", "trot", "pace", "bound", "pronk", "crawl")
ALL = "all"

_STEP = 0.05
"""Of a velocity with a key press, m/s and rad/s."""

_SIGNS = {
    "up": ("vx", 1),
    "down": ("vx", -1),
    "a": ("vy", 1),
    "d": ("vy", -1),
    "left": ("wz", 1),
    "right": ("wz", -1),
}
_PUSH_FORCE = {"p": 100.0, "o": -100.0}
_PUSH_DURATION = 0.3


class Pilot:
    """A director that key presses steer; orders hold from the next tick on, and `q` ends the run.

    A payload in hands is led, and any body can be pushed. Robots on bars are led all at once or one
    by one, and not pushed.

    Args:
        led: names of those that have velocities of their own: the payload, or all robots.
        pushed: names of the bodies that can be pushed.
        gait: name of the gait that everybody starts with.
        limits: of vx, vy (m/s) and wz (rad/s).

    Attributes:
        target: whom keys act on, of `targets`.
        note: what the last key came to, in words.
        velocities: of those led, each in its own heading.
    """

    def __init__(
        self,
        led: Sequence[str],
        pushed: Sequence[str],
        gait: str,
        limits: tuple[float, float, float] = (0.8, 0.4, 0.5),
    ) -> None:
        self._led, self._can_push, self.gait = tuple(led), bool(pushed), gait
        self.targets = tuple(pushed) or (*led, ALL)
        self.target = self.targets[-1]
        self.note = ""
        self.has_quit = False
        self.velocities = [Velocity()] * len(self._led)
        self._limits = dict(zip(("vx", "vy", "wz"), limits, strict=True))
        self._gait_orders: list[str] = []
        self._push_orders: list[tuple[str, float]] = []
        self._pushes: tuple[Push, ...] = ()

    @classmethod
    def of(cls, scenario: AnyScenario) -> Pilot:
        """A pilot of the scenario's team."""
        if isinstance(scenario, BarScenario):
            return cls(scenario.names, (), scenario.gait.name, (0.6, 0.2, 0.4))
        return cls(("payload",), scenario.bodies, scenario.robots[0].gait.name)

    @property
    def keys(self) -> tuple[tuple[str, str], ...]:
        """What each key does, for a screen."""
        whom = "whom to push" if self._can_push else "whom to drive"
        pushing = (("p, o", "push to the left, right"),) if self._can_push else ()
        return (
            ("up, down", "faster, slower"),
            ("left, right", "turn"),
            ("a, d", "sideways"),
            ("space", "stop"),
            ("1 to 6", ", ".join(GAITS)),
            ("tab", whom),
            *pushing,
            ("q", "quit"),
        )

    def described(self) -> str:
        """Whom keys act on, the gait, and the velocity of the first who is driven."""
        now = self.velocities[self._driven()[0]]
        told = f"{now.vx:.2f} m/s, {now.vy:.2f} m/s, {now.wz:.2f} rad/s"
        return f"{self.target}, {self.gait}: {told}"

    def press(self, key: str) -> None:
        """Takes a key: "up", "down", "left", "right", "space", "tab", or a character."""
        self.note = ""
        if key in _SIGNS:
            self._change_velocity(*_SIGNS[key])
        elif key == "space":
            self._stop()
        elif key.isdecimal() and 1 <= int(key) <= len(GAITS):
            self._change_gait(GAITS[int(key) - 1])
        elif key == "tab":
            following = self.targets.index(self.target) + 1
            self.target = self.targets[following % len(self.targets)]
        elif key in _PUSH_FORCE and self._can_push:
            self._push_orders.append((self.target, _PUSH_FORCE[key]))
            self.note = f"{self.target} is pushed with {abs(_PUSH_FORCE[key]):.0f} N"
        elif key == "q":
            self.has_quit = True

    def at(self, time: float, pose: NDArray[np.float64], period: float) -> Orders | None:
        """As of `Director`: what was pressed since the last tick begins now; the first tick is
        always taken.
        """
        if self.has_quit and time > 0:
            return None
        changes = tuple(
            GaitChange(time=time, gait=GaitChoice(name=gait)) for gait in self._gait_orders
        )
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        self._pushes += tuple(
            Push(
                body=body,
                force=(float(-sin * force), float(cos * force), 0.0),
                start=time,
                duration=_PUSH_DURATION,
            )
            for body, force in self._push_orders
        )
        self._gait_orders, self._push_orders = [], []
        return Orders(tuple(self.velocities), changes, self._pushes)

    def _driven(self) -> list[int]:
        """Whose velocities keys change."""
        one = len(self._led) > 1 and self.target != ALL
        return [self._led.index(self.target)] if one else list(range(len(self._led)))

    def _stop(self) -> None:
        for i in self._driven():
            self.velocities[i] = Velocity()

    def _change_velocity(self, name: str, sign: int) -> None:
        if self.gait == "stand":
            self.note = "standing: choose a gait first (2 to 6)"
            return
        limit = self._limits[name]
        for i in self._driven():
            wanted = round(getattr(self.velocities[i], name) + sign * _STEP, 3)
            self.velocities[i] = replace(
                self.velocities[i], **{name: min(max(wanted, -limit), limit)}
            )

    def _change_gait(self, gait: str) -> None:
        # Feet that never move cannot follow a velocity.
        if gait == "stand":
            self.velocities = [Velocity()] * len(self._led)
        self.gait = gait
        self._gait_orders.append(gait)
