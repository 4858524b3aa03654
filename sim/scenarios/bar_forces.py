"""Forces from outside, as data: sinusoids, pushes and ropes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palanquin import _sim
from palanquin.problems import checks
from palanquin.schema import StrictData
from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.limits import require_number

Vector = tuple[float, float, float]

FOREVER = 1e9
"""Later than any run's end, s."""

MOST_FORCE = 1e5
"""Along an axis, N: some thousand times what a robot weighs is a mistake."""


def _require_force(field: str, force: Vector) -> None:
    for value in checks.array(field, force, 3).tolist():
        require_number(field, value, -MOST_FORCE, MOST_FORCE, "N")


def _require_order(field: str, start: float, end: float) -> None:
    require_number(f"{field}.start", start, 0.0, math.inf, "s")
    if not end >= start:
        raise InputError(f"{field}: from {start} to {end} s; start and end in order")


@dataclass(frozen=True)
class Force(StrictData):
    """A force on robot `robot` (by index) at its trunk's origin, world axes.

    amplitude sin(2 pi (t - start) / period + phase) on each axis; an infinite period with a phase
    of pi / 2 is constant, as `constant` makes it.

    Attributes:
        robot: index of the robot.
        amplitude: N, [3].
        period: s, [3].
        phase: rad, [3].
        start, end: s.
    """

    robot: int
    amplitude: Vector
    period: Vector = (1.0, 0.7, 0.4)
    phase: Vector = (0.0, 0.0, 0.0)
    start: float = 1.0
    end: float = FOREVER

    def __post_init__(self) -> None:
        _require_force("force.amplitude", self.amplitude)
        checks.array("force.phase", self.phase, 3)
        if len(self.period) != 3:
            raise InputError(f"force.period: {self.period} must be three positive times")
        for period in self.period:
            require_number("force.period", period, 1e-6, math.inf, "s")
        _require_order("force", self.start, self.end)

    @classmethod
    def constant(cls, robot: int, value: Vector, start: float = 1.0, end: float = FOREVER) -> Force:
        """The force `value` (N) from `start` to `end`: a push, or a steady load."""
        return cls(robot, value, (math.inf,) * 3, (math.pi / 2,) * 3, start, end)

    def at(self, time: float) -> np.ndarray:
        """The force at `time` (s), [3], N."""
        return np.asarray(self.on(0).force(time))

    def on(self, body: int) -> _sim.Push:
        """The same on a body of the model."""
        push = _sim.Push()
        push.body = body
        push.amplitude = np.array(self.amplitude)
        push.period, push.phase = np.array(self.period), np.array(self.phase)
        push.start, push.end = self.start, self.end
        return push


@dataclass(frozen=True)
class Rope(StrictData):
    """A rope from robot `robot`'s trunk to an anchor that a person walks away with.

    Attributes:
        robot: index of the robot.
        anchor: at `start`, world, m, [3].
        velocity: of the anchor, m/s, [3].
        slack: length at which the rope gets taut, m.
        stiffness: N/m.
        damping: N s/m.
        start, end: s.
    """

    robot: int
    anchor: Vector
    velocity: Vector = (0.0, 0.0, 0.0)
    slack: float = 1.0
    stiffness: float = 60.0
    damping: float = 10.0
    start: float = 1.0
    end: float = FOREVER

    def __post_init__(self) -> None:
        checks.array("rope.anchor", self.anchor, 3)
        checks.array("rope.velocity", self.velocity, 3)
        require_number("rope.velocity", float(np.abs(self.velocity).max()), 0.0, 10.0, "m/s")
        require_number("rope.slack", self.slack, 0.0, 100.0, "m")
        require_number("rope.stiffness", self.stiffness, 0.0, 1e5, "N/m")
        require_number("rope.damping", self.damping, 0.0, 1e4, "N s/m")
        _require_order("rope", self.start, self.end)

    def on(self, body: int) -> _sim.Tether:
        """The same on a body of the model."""
        tether = _sim.Tether()
        tether.body = body
        tether.anchor, tether.velocity = np.array(self.anchor), np.array(self.velocity)
        tether.slack, tether.stiffness, tether.damping = self.slack, self.stiffness, self.damping
        tether.start, tether.end = self.start, self.end
        return tether
