"""Runs over many seeds, which can be stopped and continued."""

from __future__ import annotations

import json
import math
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from palanquin.problems.clm.references import Velocity
from palanquin.sim.errors import InputError
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import run_bars
from palanquin.sim.scenarios.bar_forces import Force, Rope
from palanquin.sim.scenarios.bar_team import BarTeam
from palanquin.sim.scenarios.bar_texts import parse_force, parse_ground
from palanquin.sim.scenarios.bars import PLANNERS, BarScenario
from palanquin.user_files import read_text

_TEN_METRES = 10.0


def _flat(seed: int) -> BarScenario:
    """30 s of flat ground at 0.5 m/s with 0, 5 or 6.8 kg, in turns."""
    payload = (0.0, 5.0, 6.8)[seed % 3]
    return BarScenario(team=BarTeam(payload=payload), duration=30.0)


def _rough(seed: int) -> BarScenario:
    """10 m of random ground of 5 cm, 5 kg and sinusoids of 20 N (V-B.2)."""
    return BarScenario(
        team=BarTeam(payload=5.0),
        ground=parse_ground("rough:0.05", seed),
        forces=_out_of_step(parse_force("sin:20", 2), seed),
        duration=40.0,
        distance=_TEN_METRES,
    )


def _rougher(seed: int) -> BarScenario:
    """10 m of random ground of 12 cm (Figure 21a)."""
    return BarScenario(ground=parse_ground("rough:0.12", seed), duration=60.0, distance=_TEN_METRES)


def _slippery(seed: int) -> BarScenario:
    """10 m with a friction coefficient of 0.3 and 4.53 kg (Figure 11c)."""
    return BarScenario(
        team=BarTeam(payload=4.53),
        ground=parse_ground("flat", seed, friction=0.3),
        duration=40.0,
        distance=_TEN_METRES,
    )


def _sinusoids(size: float) -> Callable[[int], BarScenario]:
    """20 s at 0.3 m/s with 5 kg under sinusoids of `size` (N) on each axis of each robot."""

    def scenario(seed: int) -> BarScenario:
        return BarScenario(
            team=BarTeam(payload=5.0),
            forces=_out_of_step(parse_force(f"sin:{size}", 2), seed),
            velocity=Velocity(0.3),
            duration=20.0,
        )

    return scenario


def _on_one_axis(size: float) -> Callable[[int], BarScenario]:
    """The same along one axis only: x, y and z in turns."""

    def scenario(seed: int) -> BarScenario:
        sizes = [0.0, 0.0, 0.0]
        sizes[seed % 3] = size
        return replace(
            _sinusoids(size)(seed),
            forces=_out_of_step(parse_force("sin:{},{},{}".format(*sizes), 2), seed),
        )

    return scenario


def _opposed(seed: int) -> BarScenario:
    """20 s at 0.3 m/s with 5 kg, both robots pressed against the bar by 30 N."""
    return BarScenario(
        team=BarTeam(payload=5.0),
        forces=parse_force("opposed:30", 2),
        velocity=Velocity(0.3),
        duration=20.0,
    )


def _out_of_step(forces: tuple[Force | Rope, ...], seed: int) -> tuple[Force, ...]:
    """Sinusoids with phases that the seed draws, on each axis of each robot."""
    random = np.random.default_rng(seed)
    sinusoids = [force for force in forces if isinstance(force, Force)]
    return tuple(replace(s, phase=tuple(random.uniform(0, 2 * np.pi, 3))) for s in sinusoids)


SUITES: dict[str, Callable[[int], BarScenario]] = {
    "flat": _flat,
    "rough": _rough,
    "rougher": _rougher,
    "slippery": _slippery,
    "sin40": _sinusoids(40.0),
    "sin60": _sinusoids(60.0),
    "axis40": _on_one_axis(40.0),
    "axis60": _on_one_axis(60.0),
    "opposed": _opposed,
}


@dataclass(frozen=True)
class Trial:
    """One run of a campaign; its figures are found again by these three."""

    suite: str
    planner: str
    seed: int

    def scenario(self) -> BarScenario:
        """What to run; every trial but that of seed 0 starts a little off."""
        return SUITES[self.suite](self.seed).changed(planner=self.planner, seed=self.seed)

    def run(self) -> dict[str, Any]:
        """Its figures, with the trial itself."""
        scenario = self.scenario()
        figures = outcome(run_bars(scenario))
        return {"suite": self.suite, "planner": self.planner, "seed": self.seed, **figures}


def trials(suite: str, planners: tuple[str, ...], seeds: int) -> list[Trial]:
    """Seeds 1 to `seeds` of a suite for each planner; raises InputError for unknown names."""
    if suite not in SUITES:
        raise InputError(f"suite: {suite!r} is not one of {', '.join(SUITES)}")
    for planner in planners:
        if planner not in PLANNERS:
            raise InputError(f"planner: {planner!r} is not one of {', '.join(PLANNERS)}")
    if not 1 <= seeds <= 10_000:
        raise InputError(f"seeds: {seeds} must be from 1 to 10000")
    return [Trial(suite, planner, seed) for seed in range(1, seeds + 1) for planner in planners]


class Results:
    """The figures of finished trials in a file, one JSON object a line.

    A line that a stop has cut off is dropped, and its trial runs again.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.rows: list[dict[str, Any]] = []
        if path.exists():
            self.rows = list(_rows(path))
            self._rewrite()

    def missing(self, wanted: list[Trial]) -> list[Trial]:
        """Those of `wanted` that are not in the file."""
        done = {(row["suite"], row["planner"], row["seed"]) for row in self.rows}
        return [t for t in wanted if (t.suite, t.planner, t.seed) not in done]

    def append(self, row: dict[str, Any]) -> None:
        """Adds the figures of a trial, at once and for good."""
        self.rows.append(row)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row, allow_nan=False) + "\n")

    def _rewrite(self) -> None:
        text = "".join(json.dumps(row, allow_nan=False) + "\n" for row in self.rows)
        partial = self.path.with_name(self.path.name + ".part")
        partial.write_text(text, encoding="utf-8")
        partial.replace(self.path)


def _rows(path: Path) -> Iterator[dict[str, Any]]:
    try:
        lines = read_text(path).splitlines()
    except ValueError as error:
        raise InputError(f"{path}: {error}") from error
    for number, line in enumerate(lines, start=1):
        try:
            row = json.loads(line)
            Trial(row["suite"], row["planner"], row["seed"])
        except (ValueError, TypeError, KeyError, RecursionError) as error:
            if number == len(lines):
                return
            raise InputError(f"{path}, line {number}: not a trial's figures ({error})") from error
        yield row


def run_trials(wanted: list[Trial], results: Results, jobs: int) -> Iterator[dict[str, Any]]:
    """Runs what is missing in `jobs` processes, and yields figures as they come."""
    if jobs < 1:
        raise InputError(f"jobs: {jobs} must be at least 1")
    missing = results.missing(wanted)
    if not missing:
        return
    workers = min(jobs, len(missing))
    with ProcessPoolExecutor(workers, initializer=_leave_interrupts_to_parent) as pool:
        futures: list[Future[dict[str, Any]]] = [pool.submit(Trial.run, t) for t in missing]
        try:
            for future in as_completed(futures):
                row = future.result()
                results.append(row)
                yield row
        except BaseException:
            _stop(pool)
            raise


def _leave_interrupts_to_parent() -> None:
    """A Ctrl-C reaches every process of a terminal; the one that asked for runs answers it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _stop(pool: ProcessPoolExecutor) -> None:
    """Ends what runs, and a pool without workers gives up what waits; without a line in the file
    these trials run again. Futures that were cancelled would make the pool's thread fail on them.
    """
    for worker in list((pool._processes or {}).values()):
        worker.terminate()


def summary(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Successes and medians for each suite and planner."""
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault((row["suite"], row["planner"]), []).append(row)
    return [
        {
            "suite": suite,
            "planner": planner,
            "trials": len(group),
            "completed": sum(row["completed"] for row in group),
            "velocity_rms_worst": max(
                (row["velocity_error_m_s"] or {"rms": math.nan})["rms"] for row in group
            ),
            "bar_length_error_max": max(row["bar_length_error_m"] for row in group),
            "torque_fraction_max": max(row["torque_fraction_max"] for row in group),
            "falls": [row["fall"]["cause"] for row in group if row["fall"]],
        }
        for (suite, planner), group in sorted(groups.items())
    ]
