"""Who carries which bars: robots in a row, a bar between each two neighbours, a load on it."""

from __future__ import annotations

from dataclasses import dataclass

from palanquin.sim.bar.limits import require_integer, require_number
from palanquin.sim.errors import InputError

AXES = ("roll", "pitch", "yaw")
ATTACH = (0.0, 0.0, 0.15)
"""Interaction point d relative to a robot's centre of mass as it stands, body axes, m."""

STANDING_HEIGHT = 0.26
"""Of the centre of mass over the ground, m (V-A.1)."""

MOST_ROBOTS = 6


@dataclass(frozen=True)
class BarTeam:
    """M A1s side by side, from left to right, M - 1 bars on ball joints between them.

    Attributes:
        robots: M, from 2.
        length: of a bar between its joints, m.
        bar_mass: of a bar, kg.
        payload: mass of the load on each bar, kg; 0 for none. No planner knows of it.
        payload_at: where on the bar it is, from 0 at the left end to 1 at the right one.
        restrict: axes about which the joints can't turn: "roll", "pitch", "yaw" (Figure 5).
    """

    robots: int = 2
    length: float = 1.0
    bar_mass: float = 0.3
    payload: float = 0.0
    payload_at: float = 0.5
    restrict: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        require_integer("robots", self.robots, 2, MOST_ROBOTS)
        require_number("bar length", self.length, 0.5, 5.0, "m")
        require_number("bar mass", self.bar_mass, 1e-4, 50.0, "kg")
        require_number("payload", self.payload, 0.0, 20.0, "kg")
        require_number("payload_at", self.payload_at, 0.0, 1.0)
        if not set(self.restrict) <= set(AXES) or len(set(self.restrict)) < len(self.restrict):
            raise InputError(f"restrict: {self.restrict} must be different ones of {AXES}")

    @property
    def names(self) -> tuple[str, ...]:
        """Of the robots, from left to right."""
        if self.robots == 2:
            return ("left", "right")
        return tuple(f"robot{i + 1}" for i in range(self.robots))

    @property
    def lanes(self) -> tuple[float, ...]:
        """The robots' y at the start, m."""
        return tuple(self.length * ((self.robots - 1) / 2 - i) for i in range(self.robots))
