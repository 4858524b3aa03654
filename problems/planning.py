"""What every planner of a team is asked and what it answers, whatever the robots carry and how."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from palanquin.events import Event
from palanquin.problems import checks
from palanquin.problems.gaits import Gait

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Velocity:
    """Planar velocity in a heading frame: a payload's, or that of a robot on bars.

    Attributes:
        vx: forward, m/s.
        vy: to the left, m/s.
        wz: yaw rate, rad/s.
    """

    vx: float = 0.0
    vy: float = 0.0
    wz: float = 0.0

    def __post_init__(self) -> None:
        for name in ("vx", "vy", "wz"):
            checks.finite(f"command.{name}", getattr(self, name))

    @property
    def core(self) -> np.ndarray:
        """As the engine takes it, [3]."""
        return np.array([self.vx, self.vy, self.wz], dtype=float)


@dataclass(frozen=True)
class Command:
    """Velocities from now on: one of a payload in hands, or of robots on bars each its own.

    Attributes:
        velocities: one for all, or one a robot.
    """

    velocities: tuple[Velocity, ...]

    @property
    def velocity(self) -> Velocity:
        """Of the payload."""
        return self.velocities[0]

    def of(self, robot: int) -> Velocity:
        """Of a robot on bars, by index."""
        return self.velocities[robot if len(self.velocities) > 1 else 0]


@dataclass(frozen=True)
class Measurement:
    """What is known of a team at an instant; R robots, B bodies, feet are LF, RF, LH, RH.

    Attributes:
        time: s.
        bodies: states [B, 13]: position of the centre of mass (m), orientation (w, x, y, z; body to
            world), velocity (m/s, world), angular velocity (rad/s, body). A payload in hands is the
            first; of a team on bars there are the robots alone.
        feet: contact points [R, 4, 3], m, world.
        footholds: where the controllers will put feet that are in the air [R, 4, 3], m, world; the
            feet themselves where only the plan decides.
        ground: heights of the ground below the robots [R], m, as they know them.
    """

    time: float
    bodies: Array
    feet: Array
    footholds: Array
    ground: Array

    @property
    def is_finite(self) -> bool:
        """Whether all that a plan begins with is."""
        return bool(np.isfinite(self.bodies).all() and np.isfinite(self.feet).all())


class Plan(Protocol):
    """A plan from a measurement over N intervals, and how it came about."""

    @property
    def time(self) -> float:
        """Of the first knot, s."""

    @property
    def bodies(self) -> Array:
        """Planned states [N+1, B, 13], as of `Measurement`; the first is as measured."""

    @property
    def feet(self) -> Array:
        """Planned feet [N, R, 4, 3], m, world; of one in the air, where it is or will stand."""

    @property
    def contacts(self) -> Flags:
        """Which feet stand at the knots, [N+1, R, 4]."""

    @property
    def forces(self) -> Array:
        """Planned forces of the ground on the feet [N, R, 4, 3], N, world."""

    @property
    def reference(self) -> Array:
        """The bodies' reference states at the first knot, [B, 13]."""

    @property
    def solve_ms(self) -> float:
        """Wall time from measurement to plan, ms."""

    @property
    def phases(self) -> Mapping[str, float]:
        """Parts of that time by name, ms; empty where they are not told."""

    @property
    def status(self) -> str:
        """Why the solver stopped, in its word."""

    @property
    def is_usable(self) -> bool:
        """Whether it is a plan; if not, it is the last one followed on."""

    @property
    def iterations(self) -> float:
        """Of the solver; NaN where it has none."""

    @property
    def cost(self) -> float:
        """Of the solver's objective; NaN without a solution."""

    @property
    def equality_violation(self) -> float:
        """The worst one; NaN where it is not told."""

    @property
    def violation(self) -> Mapping[str, float]:
        """The worst violation of each family of inequalities, in its unit."""

    @property
    def more(self) -> Mapping[str, Array]:
        """What only some teams have, by name: see `sim.runs.record.Record`."""

    @property
    def events(self) -> tuple[Event, ...]:
        """What went otherwise than by full steps."""


class Planner(Protocol):
    """Who plans for a team, from what is measured and what is commanded."""

    @property
    def plan_time(self) -> Array:
        """Times of a plan's knots relative to the measurement [N+1], s."""

    def reference_at(self, time: float) -> Array:
        """Reference (x, y, yaw) [3] of what is led at `time`, m and rad."""

    def change_gait(self, robot: int, gait: Gait, time: float, at_once: bool = False) -> float:
        """Has a robot begin another gait at the first end of a cycle from `time` (s) on, or
        `at_once`; returns when that is, s.
        """

    def expect_wrenches(self, wrenches: Array) -> None:
        """Tells of pushes to come: mean force (N) and torque (N m) on each body, world, during the
        intervals that the next plan is for, [N+1, B, 6]. Raises ProblemError where they are not
        zero and the model has no place for them.
        """

    def plan(self, seen: Measurement, command: Command) -> Plan:
        """The plan for what is seen; never without one. The first call may take its time: the team
        still stands.
        """


def plan_time(horizon: int, dt: float) -> Array:
    """Times of the knots of `horizon` intervals of `dt` (s), [N+1], s."""
    return dt * np.arange(horizon + 1, dtype=np.float64)
