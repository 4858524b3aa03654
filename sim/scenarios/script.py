"""What a team is told and suffers during a run, tick by tick."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from palanquin.problems.planning import Command
from palanquin.sim.scenarios.command import Course
from palanquin.sim.scenarios.disturbance import Push
from palanquin.sim.scenarios.gait import GaitChange


@dataclass(frozen=True)
class Orders(Command):
    """At one tick: a command from now on, gait changes to begin, and pushes now or later."""

    gait_changes: tuple[GaitChange, ...] = ()
    pushes: tuple[Push, ...] = ()

    def changes_of(self, robots: Sequence[str]) -> Iterator[tuple[int, GaitChange]]:
        """Each change of gait with the index of each robot, of those so named, that it is for."""
        for change in self.gait_changes:
            for index, name in enumerate(robots):
                if name in (change.robots or (name,)):
                    yield index, change


class Director(Protocol):
    """Who directs a run: a script, or somebody at a keyboard."""

    def at(self, time: float, pose: NDArray[np.float64], period: float) -> Orders | None:
        """Orders at the tick `time` (s), `period` (s) before the next one; None ends the run.

        `pose` (x, y, yaw) [3] (m, rad) is the payload's reference at that time, of robots on bars
        the first one's. Called once a tick, in the order of time.
        """


class Script:
    """Orders that were written down before the run."""

    def __init__(
        self, command: Course, gait_changes: Sequence[GaitChange], pushes: Sequence[Push]
    ) -> None:
        self._command = command
        self._gait_changes = sorted(gait_changes, key=lambda change: change.time)
        self._pushes = tuple(pushes)

    def at(self, time: float, pose: NDArray[np.float64], period: float) -> Orders:
        """As of `Director`; a change of gait is ordered at the first tick from its time on."""
        due = tuple(c for c in self._gait_changes if c.time <= time + 1e-9)
        del self._gait_changes[: len(due)]
        return Orders((self._command.velocity(time, pose, period),), due, self._pushes)
