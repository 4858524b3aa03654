"""Commands in scenarios: velocities at times, or poses that the payload passes through."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Literal, Protocol, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from palanquin.problems.planning import Velocity
from palanquin.schema import Finite, NonNegative, Positive, Strict
from palanquin.sim.scenarios.vectors import Name

# An instant that rounding has put just before a step counts as the step's, s.
_LATE = 1e-9

# A waypoint this near has been reached: m, rad.
_NEAR = 1e-4


class Course(Protocol):
    """Tells a team at every tick how fast its payload's reference shall move."""

    def velocity(self, time: float, pose: NDArray[np.float64], period: float) -> Velocity:
        """The velocity from `time` (s) on for a `period` (s), given the payload's reference pose
        (x, y, yaw) [3] (m, rad) at that time.
        """


class VelocityStep(Strict):
    """A velocity in the payload's heading frame from a time on."""

    time: NonNegative = Field(0.0, description="s")
    vx: Finite = Field(0.0, description="forward, m/s")
    vy: Finite = Field(0.0, description="to the left, m/s")
    wz: Finite = Field(0.0, description="yaw rate, rad/s")


class VelocityChange(VelocityStep):
    """Another velocity of robots on bars from a time on, each in its own heading."""

    robots: Annotated[tuple[Name, ...], Field(strict=False)] = Field(
        (), description="who changes; everybody unless told"
    )

    @property
    def velocity(self) -> Velocity:
        """As robots are told it."""
        return Velocity(self.vx, self.vy, self.wz)


class VelocityCommand(Strict):
    """Velocities, each until the next; none before the first."""

    type: Literal["velocity"]
    steps: Annotated[tuple[VelocityStep, ...], Field(strict=False, min_length=1)]

    @model_validator(mode="after")
    def _require_order(self) -> Self:
        times = [step.time for step in self.steps]
        if any(late <= early for early, late in pairwise(times)):
            raise ValueError(f"steps are at {times} s; each must come after the one before")
        return self

    def at(self, time: float) -> Velocity:
        """The velocity at `time`, s."""
        current = Velocity()
        for step in self.steps:
            if step.time > time + _LATE:
                break
            current = Velocity(step.vx, step.vy, step.wz)
        return current

    def changes(self) -> list[float]:
        """When the velocity changes, s."""
        return [step.time for step in self.steps]

    def moves(self, time: float) -> bool:
        """Whether the payload is to move at `time`, s."""
        return self.at(time) != Velocity()

    def start(self) -> _Steps:
        """The command as a run asks for it."""
        return _Steps(self)


class _Steps:
    def __init__(self, command: VelocityCommand) -> None:
        self._command = command

    def velocity(self, time: float, pose: NDArray[np.float64], period: float) -> Velocity:
        return self._command.at(time)


class Waypoint(Strict):
    """A pose of the payload over the ground, world frame."""

    x: Finite = Field(description="m")
    y: Finite = Field(0.0, description="m")
    yaw: Finite | None = Field(
        None, description="heading, rad, to which it turns the shorter way; as before unless told"
    )
    speed: Positive | None = Field(None, description="on the way there, m/s")
    hold: NonNegative = Field(0.0, description="rest there, s")


class WaypointCommand(Strict):
    """Poses to pass through, in straight lines at constant speed.

    The payload's reference is driven by velocity commands that take it to the next pose; it turns
    evenly and the shorter way round, and slows down where that would exceed the turn rate.
    """

    type: Literal["waypoints"]
    through: Annotated[tuple[Waypoint, ...], Field(strict=False, min_length=1)]
    speed: Positive = Field(0.3, description="m/s")
    turn_rate: Positive = Field(0.3, description="at most, rad/s")

    def changes(self) -> list[float]:
        """When the command starts, s."""
        return [0.0]

    def moves(self, time: float) -> bool:
        """Always: how long it takes is known only under way."""
        return True

    def start(self) -> WaypointFollower:
        """The command as a run asks for it; remembers how far it has come."""
        return WaypointFollower(self)


class WaypointFollower:
    """Turns poses into velocity commands, one waypoint after the other."""

    def __init__(self, command: WaypointCommand) -> None:
        self._command = command
        self._next = 0
        self._yaw: float | None = None
        self._resting_until: float | None = None

    def velocity(self, time: float, pose: NDArray[np.float64], period: float) -> Velocity:
        """Towards the next waypoint, so as to be on it at the end of a period at the latest."""
        x, y, yaw = pose
        if self._yaw is None:
            self._yaw = yaw
        while self._next < len(self._command.through):
            waypoint = self._command.through[self._next]
            wanted = self._yaw if waypoint.yaw is None else waypoint.yaw
            turn = math.remainder(wanted - yaw, 2 * math.pi)
            way = np.array([waypoint.x - x, waypoint.y - y])
            if max(np.hypot(*way), abs(turn)) > _NEAR:
                speed = waypoint.speed or self._command.speed
                seconds = max(np.hypot(*way) / speed, abs(turn) / self._command.turn_rate, period)
                cos, sin = np.cos(yaw), np.sin(yaw)
                vx, vy = np.array([[cos, sin], [-sin, cos]]) @ way / seconds
                return Velocity(float(vx), float(vy), float(turn / seconds))
            if self._rests(waypoint, time):
                break
            self._yaw, self._next = yaw, self._next + 1
        return Velocity()

    def _rests(self, waypoint: Waypoint, time: float) -> bool:
        if self._resting_until is None:
            self._resting_until = time + waypoint.hold
        if time < self._resting_until - _LATE:
            return True
        self._resting_until = None
        return False


AnyCommand = Annotated[VelocityCommand | WaypointCommand, Field(discriminator="type")]
