"""Planning for robots on bars, each led at a velocity of its own: references, contacts, the QP."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palanquin import _core
from palanquin.errors import LoweringError, ProblemError
from palanquin.events import Event
from palanquin.problems import checks
from palanquin.problems.gaits import Gait
from palanquin.problems.layered.planner import LayeredPlan, Planner
from palanquin.problems.layered.reference import Leash
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
        core: as the engine has it.
        contacts: flags [N+1, R, 4] at the knots.
        friction: coefficient that it counts on.
        events: what the planner could not do at this tick.
    """

    core: _core.BarPlan
    contacts: NDArray[np.bool_]
    friction: float
    events: tuple[Event, ...]

    @property
    def layered(self) -> LayeredPlan:
        """Of the layered planner."""
        return self.core.layered

    @property
    def time(self) -> float:
        """Of the first knot, s."""
        return self.layered.time

    @property
    def bodies(self) -> Array:
        """States [N+1, R, 13]: the first as measured, and all rotations about the measured ones."""
        return self.core.bodies

    @property
    def feet(self) -> Array:
        """Where they are, or will stand, over the horizon, [N, R, 4, 3]: no step is planned."""
        return self.core.feet

    @property
    def forces(self) -> Array:
        """Planned ground reaction forces in the world [N, R, 4, 3], N."""
        return self.layered.inputs

    @property
    def reference(self) -> Array:
        """Reference states of the robots at the first knot, [R, 13]."""
        return self.core.reference

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
        return {"friction": self.core.friction_violation(self.friction)}

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
        self._schedule = schedule
        self._core = _core.BarPlanner(planner.core, leash.in_circle, leash.length)
        self._plan_time = plan_time(planner.settings.horizon, planner.settings.dt)

    @property
    def plan_time(self) -> Array:
        """Times of a plan's knots relative to the measurement [N+1], s."""
        return self._plan_time

    def reference_at(self, time: float) -> Array:
        """The first robot's (x, y, yaw) [3], m and rad."""
        return self._core.reference

    def change_gait(self, robot: int, gait: Gait, time: float, at_once: bool = False) -> float:
        """Has a robot begin another gait, see `GaitClock.change`; returns when that is, s."""
        return self._schedule.change_gait(robot, gait, time, at_once)

    def expect_wrenches(self, wrenches: ArrayLike) -> None:
        """Raises ProblemError for pushes: the layered planners' model has none."""
        if np.asarray(wrenches).any():
            raise ProblemError("wrenches: planners of robots on bars cannot be told of pushes")

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Writes the planner as one folder, for C++ programs without Python: its problems, see
        `Lowered.save`, in folders of their own, and the file `planner` (C++ `bar_planner_file.hpp`
        says what is in it). C++ `load_bar_planner` reads it; on the same measurements and contacts
        its plans are these, bit by bit.

        The planner is saved as it was built, before its first plan.

        Returns:
            The folder.

        Raises:
            LoweringError: it is a file or cannot be written, or holds other things where the
                problems go.
        """
        path, problems = Path(folder), self.planner.problems
        names = [f"problem{i + 1}" for i in range(len(problems))]
        try:
            path.mkdir(parents=True, exist_ok=True)
            for name, mpc in zip(names, problems, strict=True):
                mpc.lowered.save(path / name)
            _core.save_bar_planner(self._core, names, str(path))
        except (OSError, RuntimeError) as error:
            raise LoweringError(str(error)) from error
        return path

    def plan(self, seen: Measurement, command: Command) -> BarPlan:
        """Moves the references on, and plans from what is seen."""
        robots = len(seen.bodies)
        contacts = self._schedule.contacts(seen.time + self._plan_time)
        commands = [command.of(i) for i in range(robots)]
        with checks.of_the_engine():
            core = self._core.plan(
                seen.time,
                seen.bodies,
                seen.feet.reshape(-1, 3),
                seen.footholds.reshape(-1, 3),
                seen.ground,
                contacts.reshape(len(contacts), -1),
                np.array([(v.vx, v.vy, v.wz) for v in commands]),
            )
        events = self.planner.note(core.layered)
        return BarPlan(core, contacts, self.planner.settings.friction, events)
