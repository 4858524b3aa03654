"""Has things break in simulated physics when a scenario says so."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from functools import singledispatchmethod

import mujoco
import numpy as np

from palanquin import _sim
from palanquin.events import Event, EventKind
from palanquin.sim.runs.plan_link import PlanLink
from palanquin.sim.scenarios.faults import (
    AnyFault,
    FaultOfRobot,
    FrictionLost,
    HandOff,
    MotorDead,
    PlannerSilent,
    PlansLate,
    SensorGone,
    StateLost,
)
from palanquin.sim.scenarios.limits import TIMESTEP
from palanquin.sim.scenes.links import GROUND

Undo = Callable[[], None]


def _for_good() -> None:
    """Nothing mends it."""


class Breakages:
    """The faults of one run.

    Args:
        faults: what breaks when.
        robots: their names.
        simulation: that steps them.
        model: its own, which changes.
        data: likewise.
        link: on which plans reach the controllers.
    """

    def __init__(
        self,
        faults: Sequence[AnyFault],
        robots: tuple[str, ...],
        simulation: _sim.TeamSimulation,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        link: PlanLink[list[_sim.RobotTarget]],
    ) -> None:
        self._to_come = sorted(faults, key=lambda fault: fault.start)
        self._robots, self._simulation, self._link = robots, simulation, link
        self._model, self._data = model, data
        self._lasting: list[tuple[float, Undo]] = []
        self._lost: Counter[tuple[int, _sim.Sense]] = Counter()

    def until(self, time: float) -> tuple[Event, ...]:
        """Breaks what is due at `time` (s) and mends what is over; tells what broke."""
        now = time + 1e-9
        over = [undo for end, undo in self._lasting if end <= now]
        self._lasting = [part for part in self._lasting if part[0] > now]
        for undo in over:
            undo()
        due = [fault for fault in self._to_come if fault.start <= now]
        del self._to_come[: len(due)]
        for fault in due:
            end = fault.start + getattr(fault, "duration", np.inf)
            self._lasting.append((end, self._break(fault)))
        return tuple(Event(time, EventKind.FAULT, self._told(fault)) for fault in due)

    def _told(self, fault: AnyFault) -> str:
        if isinstance(fault, FaultOfRobot):
            return f"{fault.whose(self._robots)}: {fault.text}"
        return fault.text

    @singledispatchmethod
    def _break(self, fault: AnyFault) -> Undo:
        raise TypeError(f"no way to break {type(fault).__name__}")

    @_break.register
    def _(self, fault: PlannerSilent) -> Undo:
        return self._link.disturb(is_silent=True)

    @_break.register
    def _(self, fault: PlansLate) -> Undo:
        return self._link.disturb(delay=math.ceil(fault.delay / TIMESTEP - 1e-9))

    @_break.register
    def _(self, fault: StateLost) -> Undo:
        return self._lose(fault.whose(self._robots), _sim.Sense.STATE)

    @_break.register
    def _(self, fault: SensorGone) -> Undo:
        return self._lose(fault.whose(self._robots), _sim.Sense.FOOT_FORCES)

    def _lose(self, robot: str, sense: _sim.Sense) -> Undo:
        index = self._robots.index(robot)

        def count(change: int) -> None:  # one fault may begin before another of its kind is over
            self._lost[index, sense] += change
            self._simulation.lose(index, sense, self._lost[index, sense] > 0)

        count(1)
        return lambda: count(-1)

    @_break.register
    def _(self, fault: MotorDead) -> Undo:
        motor = self._model.actuator(f"{fault.whose(self._robots)}/{fault.joint}")
        motor.gainprm[0] = 0.0
        return _for_good

    @_break.register
    def _(self, fault: HandOff) -> Undo:
        weld = self._model.equality(f"hold/{fault.whose(self._robots)}").id
        self._data.eq_active[weld] = 0
        return _for_good

    @_break.register
    def _(self, fault: FrictionLost) -> Undo:
        ground = (self._model.geom_bodyid == 0) & (self._model.geom_contype == GROUND)
        self._model.geom_friction[ground, 0] *= fault.share
        return _for_good
