"""Steps of a closed loop taken once more, back to back: the engine without what is around it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from palanquin.lowered import Lowered
from palanquin.plan import Plan, Sqp

Inputs = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""Parameters, measured knot and guess of one solve."""


class RecordingSqp(Sqp):
    """An `Sqp` that keeps what it is asked to solve."""

    def __init__(self, lowered: Lowered, **options: Any) -> None:
        super().__init__(lowered, **options)
        self.inputs: list[Inputs] = []

    def solve(self, *inputs: Any, **named: Any) -> Plan:
        """As `Sqp.solve`. Copies are made afterwards, so that they warm no cache."""
        plan = super().solve(*inputs, **named)
        p, z, start = self._inputs(*inputs, **named)
        self.inputs.append((p.copy(), z.copy(), start.copy()))
        return plan


class Replay:
    """Takes the recorded steps of a loop again, `EVERY` in a row, by a solver of its own.

    Between two steps of a loop in Python its other work drives the solver's data out of the
    processor's caches; here a step follows the last one at once, as in a loop in C++.
    """

    EVERY = 32

    def __init__(self, recorder: RecordingSqp, options: dict[str, Any]) -> None:
        self._recorder = recorder
        self._sqp = Sqp(recorder.lowered, **options)

    def measure(self) -> tuple[float, ...]:
        """Milliseconds of every step since the last replay, if it is time for one; else ()."""
        inputs = self._recorder.inputs
        if len(inputs) < self.EVERY:
            return ()
        times = []
        for step in inputs:
            self._sqp.advance(*step)
            times.append(float(self._sqp.times_ms.total))
        inputs.clear()
        return tuple(times)
