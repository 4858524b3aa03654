"""Robots on bars driven by keys, all at once or one by one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from palanquin.problems.clm.references import Velocity
from palanquin.sim.scenarios.script import Orders

HELP = "arrows: faster, slower, turn; a, d: sideways; tab: which robot; space: stop; q: end"

_STEPS = {
    "up": ("vx", 0.1),
    "down": ("vx", -0.1),
    "left": ("wz", 0.1),
    "right": ("wz", -0.1),
    "a": ("vy", 0.05),
    "d": ("vy", -0.05),
}
_MOST = {"vx": 0.6, "vy": 0.2, "wz": 0.4}


class Driver:
    """Commands of M robots, changed by keys (see `HELP`).

    Attributes:
        commands: of the robots, each in its own heading.
        chosen: index of the robot that keys act on; None for all.
        has_ended: `q` was pressed.
    """

    def __init__(self, robots: int) -> None:
        self.commands = [Velocity()] * robots
        self.chosen: int | None = None
        self.has_ended = False

    def press(self, key: str) -> None:
        """One key; those that mean nothing do nothing."""
        if key == "q":
            self.has_ended = True
        elif key == "tab":
            following = 0 if self.chosen is None else self.chosen + 1
            self.chosen = None if following == len(self.commands) else following
        elif key == "space":
            self._change(lambda command: Velocity())
        elif key in _STEPS:
            field, step = _STEPS[key]
            self._change(lambda command: _stepped(command, field, step))

    def describe(self, names: Sequence[str]) -> str:
        """Who is driven, and how fast."""
        who = "all" if self.chosen is None else names[self.chosen]
        command = self.commands[self.chosen or 0]
        return f"{who}: {command.vx:.1f} m/s, {command.vy:.2f} m/s, {command.wz:.1f} rad/s"

    def at(self, time: float, pose: NDArray[np.float64], period: float) -> Orders | None:
        """As of `Director`: what was pressed last; the first tick is always taken."""
        return None if self.has_ended and time > 0 else Orders(tuple(self.commands))

    def _change(self, change: Callable[[Velocity], Velocity]) -> None:
        for robot, command in enumerate(self.commands):
            if self.chosen in (None, robot):
                self.commands[robot] = change(command)


def _stepped(command: Velocity, field: str, step: float) -> Velocity:
    most = _MOST[field]
    value = min(max(getattr(command, field) + step, -most), most)
    return replace(command, **{field: round(value, 6)})
