"""Planning for robots on bars, each led at a velocity of its own: references, contacts, the QP."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palanquin.errors import ProblemError
from palanquin.events import Event
from palanquin.problems import quaternions
from palanquin.problems.gaits import Gait
from palanquin.problems.layered.planner import Desired, LayeredPlan, Planner, RobotStates
from palanquin.problems.layered.reference import Leash, Reference
from palanquin.problems.planning import Command, Measurement, plan_time

Array = NDArray[np.float64]


class Schedule(Protocol):
    """The gait clocks of those who move the feet."""

    def contacts(self, times: Array) -> NDArray[np.bool_]:
        """Which feet stand at `times` [n], s: [n, R, 4]."""

    def change_gait(self, robot: int, gait: Gait, time: float, at_once: bool = False) -> float:
        """Has a robot begin another gait, see `GaitClock.change`; returns when that is, s."""


@dataclass(frozen=True)
class BarPlan:
    """A plan of one period, with what it was planned for; as of `planning.Plan`.

    Attributes:
        layered: of the layered planner.
        seen: the measurement.
        contacts: flags [N+1, R, 4] at the knots.
        footholds: [R, 4, 3], m, world: where the feet are, or will stand.
        references: of the robots.
        friction: coefficient that it counts on.
        events: what the planner could not do at this tick.
    """

    layered: LayeredPlan
    seen: Measurement
    contacts: NDArray[np.bool_]
    footholds: Array
    references: tuple[Reference, ...]
    friction: float
    events: tuple[Event, ...]

    @property
    def time(self) -> float:
        """Of the first knot, s."""
        return self.layered.time

    @cached_property
    def bodies(self) -> Array:
        """States [N+1, R, 13]: the first as measured, and all rotations about the measured ones."""
        states = self.layered.states
        turn = quaternions.from_rotation_vector(states[..., 6:9])
        orientation = quaternions.multiply(self.seen.bodies[:, 3:7], turn)
        return np.concatenate(
            [states[..., 0:3], orientation, states[..., 3:6], states[..., 9:12]], axis=-1
        )

    @property
    def feet(self) -> Array:
        """The footholds over the horizon, [N, R, 4, 3]: no step is planned."""
        return np.broadcast_to(self.footholds, (len(self.contacts) - 1, *self.footholds.shape))

    @property
    def forces(self) -> Array:
        """Planned ground reaction forces in the world [N, R, 4, 3], N."""
        return self.layered.inputs

    @property
    def reference(self) -> Array:
        """Reference states of the robots at the first knot, [R, 13]."""
        return np.array([reference.body for reference in self.references])

    @property
    def solve_ms(self) -> float:
        """Wall time of the planner, ms."""
        return self.layered.solve_ms

    @property
    def phases(self) -> Mapping[str, float]:
        """None is told."""
        return {}

    @property
    def status(self) -> str:
        """Why the solver stopped."""
        return self.layered.status

    @property
    def is_usable(self) -> bool:
        """Whether this is a solution; if not, it is the last one, shifted."""
        return self.layered.is_usable

    @property
    def iterations(self) -> float:
        """Not told."""
        return np.nan

    @property
    def cost(self) -> float:
        """Of all robots' QPs; NaN without a solution."""
        return sum(self.layered.cost) if self.layered.cost else np.nan

    @property
    def equality_violation(self) -> float:
        """Not told."""
        return np.nan

    @property
    def violation(self) -> Mapping[str, float]:
        """By how much forces until the next knot leave the friction pyramid (9), N."""
        force = self.forces[0]
        cone = self.friction / np.sqrt(2) * force[..., 2]
        return {"friction": max(0.0, float((np.abs(force[..., :2]).max(axis=-1) - cone).max()))}

    @property
    def more(self) -> Mapping[str, Array]:
        """Each robot's estimate of the multipliers, [R, rows of the bars]."""
        return {"estimates": self.layered.estimates}


class BarPlanner:
    """Leads each robot at its own velocity, as of `planning.Planner`.

    Args:
        planner: any of the layered ones.
        schedule: the gait clocks of those who move the feet.
        leash: how far references may run ahead of the robots.
    """

    def __init__(self, planner: Planner, schedule: Schedule, leash: Leash) -> None:
        self.planner = planner
        self._schedule, self._leash = schedule, leash
        self.references: tuple[Reference, ...] = ()
        self._time = 0.0  # of the last plan
        self._told = 0

    @property
    def plan_time(self) -> Array:
        """Times of a plan's knots relative to the measurement [N+1], s."""
        return plan_time(self.planner.settings.horizon, self.planner.settings.dt)

    def reference_at(self, time: float) -> Array:
        """The first robot's (x, y, yaw) [3], m and rad."""
        if not self.references:
            return np.zeros(3)
        first = self.references[0]
        return np.array([*first.position[:2], first.yaw])

    def change_gait(self, robot: int, gait: Gait, time: float, at_once: bool = False) -> float:
        """Has a robot begin another gait, see `GaitClock.change`; returns when that is, s."""
        return self._schedule.change_gait(robot, gait, time, at_once)

    def expect_wrenches(self, wrenches: ArrayLike) -> None:
        """Raises ProblemError for pushes: the layered planners' model has none."""
        if np.any(wrenches):
            raise ProblemError("wrenches: planners of robots on bars cannot be told of pushes")

    def plan(self, seen: Measurement, command: Command) -> BarPlan:
        """Moves the references on, and plans from what is seen."""
        robots = range(len(seen.bodies))
        if not self.references:
            self.references = tuple(Reference.at(seen.bodies[i], self._leash) for i in robots)
            self._time = seen.time
        elapsed = round(seen.time - self._time, 9)  # without the rounding of two times
        for i, reference in zip(robots, self.references, strict=True):
            reference.advance(command.of(i), seen.bodies[i], float(seen.ground[i]), elapsed)
        self._time = seen.time
        contacts = self._schedule.contacts(seen.time + self.plan_time)
        feet = np.where(contacts[0][..., None], seen.feet, seen.footholds)
        layered = self.planner.plan(
            seen.time, _states(seen.bodies, feet), contacts, _desired(self.references)
        )
        events = tuple(self.planner.events[self._told :])
        self._told += len(events)
        still = tuple(reference.copy() for reference in self.references)
        friction = self.planner.settings.friction
        return BarPlan(layered, seen, contacts, feet, still, friction, events)


def _states(bodies: Array, feet: Array) -> RobotStates:
    return RobotStates(
        position=bodies[:, :3],
        velocity=bodies[:, 7:10],
        rotation=quaternions.matrix(bodies[:, 3:7]),
        angular_velocity=bodies[:, 10:13],
        feet=feet,
    )


def _desired(references: tuple[Reference, ...]) -> Desired:
    return Desired(
        position=np.array([r.position for r in references]),
        velocity=np.array([r.velocity for r in references]),
        rotation=np.array([r.rotation for r in references]),
        angular_velocity=np.array([[0.0, 0.0, r.yaw_rate] for r in references]),
    )
