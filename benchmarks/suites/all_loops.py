"""All closed loops, hard and penalised, by all controllers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, get_args

import numpy as np

from palanquin.benchmarks.suites.carrying_loop import CARRYING_LOOPS, CarryingLoop
from palanquin.benchmarks.suites.loops import (
    COLLECTION_LOOPS,
    CONTROLLERS,
    CONVERGED,
    Controller,
    Loop,
    Rows,
)

Row = dict[str, Any]
LOOPS: tuple[Loop | CarryingLoop, ...] = (*COLLECTION_LOOPS, *CARRYING_LOOPS)


def run_loops(
    loops: Sequence[Loop | CarryingLoop],
    seed: int,
    announce: Callable[[str], None],
    controllers: tuple[Controller, ...] = CONTROLLERS,
    repetitions: int = 1,
) -> list[Row]:
    """A row for each loop, kind of rows and controller.

    `cost_ratio` is relative to the loop that solves every period to convergence, null where there
    is none or the plant went beyond all numbers. Loops repeat themselves: of each period's times
    the least counts, so that what interrupts the machine does not.
    """
    rows = []
    for loop in loops:
        for limits in get_args(Rows):
            announce(f"{loop.name}, {limits}")
            runs = [loop.run(limits, controllers, seed) for _ in range(repetitions)]
            for same in zip(*runs, strict=True):
                same[0].solve_ms = np.min([run.solve_ms for run in same], axis=0).tolist()
            results = [result.to_json() for result in runs[0]]
            best = results[0]["cost"] if controllers[0] == CONVERGED else None
            for controller, result in zip(controllers, results, strict=True):
                names = {"loop": loop.name, "limits": limits, "controller": controller.name}
                is_known = best is not None and result["cost"] is not None
                ratio = result["cost"] / best if is_known else None
                rows.append({**names, "steps": loop.steps, "cost_ratio": ratio, **result})
    return rows
