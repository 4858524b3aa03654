"""Which loads the three planners survive on the reduced-order plant, with both sets of weights."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from palanquin.benchmarks.layered.runs import REDUCED, reduced_loop
from palanquin.problems import quaternions
from palanquin.problems.layered import VARIANTS
from palanquin.sim.runs.record import Record
from palanquin.sim.scenarios.bar_planners import KINDS

LOADS = (
    "none",
    *(f"sinusoid-{n}" for n in (20, 40, 60, 80)),
    *(f"across-{n}" for n in (10, 20, 30, 50)),
    *(f"along-{n}" for n in (10, 30, 50)),
    *(f"payload-{kg}" for kg in ("2.5", "5", "6.8")),
    "unequal",
)
"""Scenarios of `REDUCED`."""


@dataclass(frozen=True)
class Run:
    """One run's outcome.

    Attributes:
        load, weights, planner: what ran.
        fell_at: s, or None.
        velocity_rms: of the error after 2 s, m/s; NaN if it did not last so long.
        failures: samples without a solution.
        tilt: largest, degrees.
        length_error: of the bar, m.
    """

    load: str
    weights: str
    planner: str
    fell_at: float | None
    velocity_rms: float
    failures: int
    tilt: float
    length_error: float

    @property
    def survived(self) -> bool:
        """Whether nobody fell."""
        return self.fell_at is None


def run_load(load: str, weights: str, planner: str, duration: float) -> Run:
    """One walk under a load."""
    log = reduced_loop(load, duration, planner, weights).run()
    late = log.time >= 2.0
    error = (log.bodies - log.references)[late][..., 7:9]
    return Run(
        REDUCED[load].summary,
        weights,
        planner,
        log.duration if log.fall else None,
        float(np.sqrt(np.mean(error**2))) if late.any() else float("nan"),
        len(log.events),
        float(np.degrees(tilts(log).max())),
        log.extremes["bar_length_error_m"],
    )


def tilts(record: Record) -> np.ndarray:
    """Angles between the robots' z axes and the vertical [T, M], rad."""
    cosine = quaternions.matrix(record.bodies[..., 3:7])[..., 2, 2]
    return np.arccos(np.clip(cosine, -1, 1))


def survival(duration: float = 8.0, loads: Sequence[str] = LOADS) -> Iterator[Run]:
    """Runs every load with every planner and both sets of weights, one after the other.

    The nominal planner has neither of the weights that differ: it runs once.
    """
    for load in loads:
        for weights in VARIANTS:
            for planner in KINDS:
                if planner == "nominal" and weights != "working":
                    continue
                yield run_load(load, weights, planner, duration)


def survival_table(runs: Sequence[Run]) -> str:
    """Markdown: a row per load, a column per planner and set of weights."""
    columns = list(dict.fromkeys((run.planner, run.weights) for run in runs))
    found = {(run.load, run.planner, run.weights): run for run in runs}
    names = [p if p == "nominal" else f"{p}, {w}" for p, w in columns]
    lines = ["| load | " + " | ".join(names) + " |", "|---" * (len(columns) + 1) + "|"]
    for load in dict.fromkeys(run.load for run in runs):
        cells = [_cell(found.get((load, *column))) for column in columns]
        lines.append(f"| {load} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _cell(run: Run | None) -> str:
    if run is None:
        return ""
    text = "stands" if run.fell_at is None else f"falls at {run.fell_at:.1f} s"
    return text + (f", {run.failures} failures" if run.failures else "")
