"""Steps of a closed loop taken once more, back to back: the engine without what is around it."""

from __future__ import annotations

from typing import Any

from palanquin.instance import Instance
from palanquin.lowered import Lowered
from palanquin.plan import Plan, Sqp


class Replay:
    """Takes the steps of a loop again, `EVERY` in a row, by a solver of its own.

    Between two steps of a loop in Python its other work drives the solver's data out of the
    processor's caches; here a step follows the last one at once, as in a loop in C++.
    """

    EVERY = 32

    def __init__(self, lowered: Lowered, options: dict[str, Any]) -> None:
        self._sqp = Sqp(lowered, **options)
        self._steps: list[Instance] = []

    def measure(self, plan: Plan) -> tuple[float, ...]:
        """Milliseconds of every step since the last replay, if `plan` is the last one until it is
        time for one; else ().
        """
        if plan.instance is not None:
            self._steps.append(plan.instance)
        if len(self._steps) < self.EVERY:
            return ()
        times = []
        for step in self._steps:
            self._sqp.advance(step.parameters, step.measured, step.guess)
            times.append(float(self._sqp.times_ms.total))
        self._steps.clear()
        return tuple(times)
