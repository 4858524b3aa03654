"""All closed loops, hard and penalised, by all controllers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, get_args

from palanquin.benchmarks.suites.carrying_loop import CARRYING_LOOPS, CarryingLoop
from palanquin.benchmarks.suites.loops import COLLECTION_LOOPS, CONTROLLERS, Loop, Rows

Row = dict[str, Any]
LOOPS: tuple[Loop | CarryingLoop, ...] = (*COLLECTION_LOOPS, *CARRYING_LOOPS)


def run_loops(
    loops: Sequence[Loop | CarryingLoop], seed: int, announce: Callable[[str], None]
) -> list[Row]:
    """A row for each loop, kind of rows and controller.

    `cost_ratio` is relative to the loop that solves every period to convergence, null where the
    plant went beyond all numbers.
    """
    rows = []
    for loop in loops:
        for limits in get_args(Rows):
            announce(f"{loop.name}, {limits}")
            results = [r.to_json() for r in loop.run(limits, CONTROLLERS, seed)]
            best = results[0]["cost"]
            for controller, result in zip(CONTROLLERS, results, strict=True):
                names = {"loop": loop.name, "limits": limits, "controller": controller.name}
                is_known = best is not None and result["cost"] is not None
                ratio = result["cost"] / best if is_known else None
                rows.append({**names, "steps": loop.steps, "cost_ratio": ratio, **result})
    return rows
