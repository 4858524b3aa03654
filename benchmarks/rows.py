"""From recorded steps to a row of results."""

from __future__ import annotations

from typing import Any

import numpy as np

from palanquin.benchmarks.runs import Step
from palanquin.benchmarks.trot import PERIOD
from palanquin.benchmarks.turns import Record
from palanquin.benchmarks.variant import Variant
from palanquin.sim.runs.run_outcome import percentiles

Row = dict[str, Any]


def make_row(
    variant: Variant,
    record: Record,
    converged_cost: float | None = None,
    qp_flops: float | None = None,
) -> Row:
    """A row of results; null where there is no number.

    Args:
        variant: what was measured.
        record: its steps.
        converged_cost: mean cost that the same loop incurs when every period is solved to the end.
        qp_flops: floating-point operations of one QP.
    """
    steps = record.steps
    failures = [step.failure for step in steps if step.failure]
    row: Row = {
        **variant.columns(),
        "horizon_s": variant.task.horizon * PERIOD,
        "steps": len(steps),
        "failed_steps": len(failures),
        "error": record.error or (failures[0] if failures else None),
        "solve_ms": None,
    }
    if not steps:
        return row
    cost = float(np.mean([step.cost for step in steps]))
    solve_ms = percentiles([step.solve_ms for step in steps])
    replay_ms = [time for step in steps for time in step.replay_ms]
    row |= {
        "solve_ms": solve_ms,
        "replay_ms": percentiles(replay_ms) if replay_ms else None,
        "phases_ms": {name: _median(steps, name) for name in steps[0].phases_ms},
        "rate_hz": 1e3 / solve_ms["p50"],
        "call_ms": percentiles([step.call_ms for step in steps]),
        "python_ms": float(np.median([step.call_ms - step.solve_ms for step in steps])),
        "setup_ms": _median_of_known([step.setup_ms for step in steps]),
        "feedback_ms": _median_of_known([step.feedback_ms for step in steps]),
        "iterations": float(np.median([step.iterations for step in steps])),
        "qps": float(np.median([step.qps for step in steps])),
        "cost": cost,
        "cost_excess": cost / converged_cost - 1 if converged_cost else None,
        "mflop": qp_flops / 1e6 if qp_flops else None,
        "gflops": _gflops(steps, qp_flops),
    }
    return row


def _median(steps: list[Step], phase: str) -> float:
    return float(np.median([step.phases_ms[phase] for step in steps]))


def _median_of_known(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.median(known)) if known else None


def _gflops(steps: list[Step], qp_flops: float | None) -> float | None:
    """Rate of the QP alone, over steps that solved exactly one: further ones reuse factors."""
    times = [s.phases_ms["update"] + s.phases_ms["solve"] for s in steps if s.qps == 1]
    if qp_flops is None or not times:
        return None
    return qp_flops / float(np.median(times)) / 1e6
