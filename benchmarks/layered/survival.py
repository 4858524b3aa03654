"""Which loads the three planners survive on the reduced-order plant, with both sets of weights."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from palanquin.problems import quaternions
from palanquin.problems.layered import (
    VARIANTS,
    CentralizedPlanner,
    DistributedPlanner,
    NominalPlanner,
    Planner,
    Team,
)
from palanquin.problems.layered.plant import Payload
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.reduced import Pushes, Walk, no_push, run_walk

PLANNERS: dict[str, Callable[..., Planner]] = {
    "centralized": CentralizedPlanner,
    "distributed": DistributedPlanner,
    "nominal": NominalPlanner,
}

# Periods of the sinusoids along x, y and z, s (Kim et al., V-B.2).
_PERIODS = np.array([1.0, 0.7, 0.4])


@dataclass(frozen=True)
class Load:
    """A load case: what is unknown to the planners, and what is asked of them."""

    name: str
    pushes: Pushes = no_push
    payload: float = 0.0
    velocity: tuple[float, ...] | np.ndarray = (0.3, 0.0, 0.0)

    def walk(self, duration: float) -> Walk:
        """The walk of this case."""
        return Walk(duration, self.velocity, Payload(self.payload), self.pushes)


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


def sinusoid(amplitude: float) -> Pushes:
    """The same force on both robots along every axis, N."""
    return lambda time: amplitude * np.sin(2 * np.pi * time / _PERIODS)


def opposed(force: float) -> Pushes:
    """Constant forces across the bar that push the robots apart, N, [2, 3]."""
    pushes = np.array([[force, 0.0, 0.0], [-force, 0.0, 0.0]])
    return lambda time: pushes


def apart(force: float) -> Pushes:
    """Constant forces along the bar that pull the robots apart, N, [2, 3]."""
    pushes = np.array([[0.0, force, 0.0], [0.0, -force, 0.0]])
    return lambda time: pushes


LOADS: tuple[Load, ...] = (
    Load("none"),
    *(Load(f"sinusoid {a} N", sinusoid(a)) for a in (20, 40, 60, 80)),
    *(Load(f"across the bar {f} N", opposed(f)) for f in (10, 20, 30, 50)),
    *(Load(f"along the bar {f} N", apart(f)) for f in (10, 30, 50)),
    *(Load(f"payload {m} kg", payload=m) for m in (2.5, 5.0, 6.8)),
    Load("0.15 and 0 m/s", velocity=np.array([[0.15, 0.0, 0.0], [0.0, 0.0, 0.0]])),
)


def run_load(load: Load, weights: str, planner: str, duration: float, team: Team) -> Run:
    """One walk under a load."""
    log = run_walk(PLANNERS[planner](team, VARIANTS[weights]), load.walk(duration), team)
    late = log.time >= 2.0
    error = (log.bodies - log.references)[late][..., 7:9]
    return Run(
        load.name,
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


def survival(
    duration: float = 8.0, loads: Sequence[Load] = LOADS, team: Team | None = None
) -> Iterator[Run]:
    """Runs every load with every planner and both sets of weights, one after the other.

    The nominal planner has neither of the weights that differ: it runs once.
    """
    team = team or Team()
    for load in loads:
        for weights in VARIANTS:
            for planner in PLANNERS:
                if planner == "nominal" and weights != "working":
                    continue
                yield run_load(load, weights, planner, duration, team)


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
