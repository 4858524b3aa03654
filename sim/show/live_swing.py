"""Feet of a running plan: where they stand, and on their way to where the plan puts them down."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palanquin.sim.runs.loop import Tick
from palanquin.sim.show.swing import Swing

Array = NDArray[np.float64]


class LiveFeet:
    """Contact points of all feet at each tick of a run that is under way.

    Unlike a recorded run's, a swing's end is not known but planned: its path is drawn anew at every
    tick, from where the foot lifted off to where the current plan lands it.
    """

    def __init__(self, dt: float) -> None:
        self._dt = dt
        self._lift_off: dict[tuple[int, int], tuple[float, Array]] = {}
        self._stood: Array | None = None

    def at(self, tick: Tick) -> Array:
        """Feet [R, 4, 3] (world, m) at a tick; ticks come in the order of time."""
        feet = tick.seen.feet.copy()
        if self._stood is None:
            self._stood = feet.copy()
        standing = tick.plan.contacts[0]
        for robot, foot in np.argwhere(~standing):
            key = (int(robot), int(foot))
            if key not in self._lift_off:
                self._lift_off[key] = (tick.time, self._stood[key].copy())
            start, origin = self._lift_off[key]
            end, touchdown = self._landing(tick, *key)
            feet[key] = Swing(start, end, origin, touchdown).position(np.array(tick.time))
        for robot, foot in np.argwhere(standing):
            self._lift_off.pop((int(robot), int(foot)), None)
            self._stood[robot, foot] = feet[robot, foot]
        return feet

    def _landing(self, tick: Tick, robot: int, foot: int) -> tuple[float, Array]:
        """When (s) and where (m) the plan lands a foot; at its end if it does not."""
        stands = tick.plan.contacts[:, robot, foot]
        knot = int(stands.argmax()) if stands.any() else len(stands) - 1
        feet = tick.plan.feet[:, robot, foot]
        return tick.time + knot * self._dt, feet[min(knot, len(feet) - 1)]
