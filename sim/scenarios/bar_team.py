"""Who carries which bars: robots in a row, a bar between each two neighbours, a load on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from palanquin.schema import StrictData
from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.limits import require_integer, require_number

AXES = ("roll", "pitch", "yaw")
ATTACH = (0.0, 0.0, 0.15)
"""Interaction point d relative to a robot's centre of mass as it stands, body axes, m."""

MOST_ROBOTS = 6


@dataclass(frozen=True)
class BarTeam(StrictData):
    """M A1s side by side, from left to right, M - 1 bars on ball joints between them.

    No planner knows of the load.
    """

    robots: Annotated[int, Field(description="M, from 2 to 6")] = 2
    length: Annotated[float, Field(description="of a bar between its joints, m")] = 1.0
    bar_mass: Annotated[float, Field(description="of a bar, kg")] = 0.3
    payload: Annotated[float, Field(description="mass of the load on each bar, kg")] = 0.0
    payload_at: Annotated[float, Field(description="where on it: 0 left end, 1 right end")] = 0.5
    restrict: Annotated[
        tuple[str, ...], Field(description="axes that joints can't turn about: roll, pitch, yaw")
    ] = ()

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
