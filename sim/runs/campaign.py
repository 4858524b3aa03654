"""Runs over many seeds, which can be stopped and continued."""

from __future__ import annotations

import json
import math
import signal
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from palanquin.sim.errors import InputError
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios.bar_forces import Force
from palanquin.sim.scenarios.bars import PLANNERS, BarScenario
from palanquin.sim.scenarios.files import load_scenario
from palanquin.sim.scenarios.library import SUITES as SUITE_FOLDER
from palanquin.user_files import read_text

SUITES = {folder.name: sorted(folder.glob("*.yaml")) for folder in sorted(SUITE_FOLDER.iterdir())}
"""Files of scenarios by suite; seeds take them in turns."""


def drawn(scenario: BarScenario, seed: int) -> BarScenario:
    """The scenario as a seed has it: ground, noise, start, and the phases of all sinusoids, which
    a suite draws on each axis of each robot.
    """
    random = np.random.default_rng(seed)
    forces = tuple(
        replace(force, phase=tuple(random.uniform(0, 2 * np.pi, 3)))
        if isinstance(force, Force) and np.isfinite(force.period).all()
        else force
        for force in scenario.disturbances
    )
    return scenario.changed(ground=replace(scenario.ground, seed=seed), forces=forces, seed=seed)


@dataclass(frozen=True)
class Trial:
    """One run of a campaign; its figures are found again by these three."""

    suite: str
    planner: str
    seed: int

    def scenario(self) -> BarScenario:
        """What to run; every trial but that of seed 0 starts a little off."""
        files = SUITES[self.suite]
        scenario = load_scenario(files[self.seed % len(files)])
        if not isinstance(scenario, BarScenario):
            raise InputError(f"suite: {self.suite!r} is of hands; only runs on bars are counted")
        return drawn(scenario, self.seed).changed(planner=self.planner)

    def run(self) -> dict[str, Any]:
        """Its figures, with the trial itself."""
        scenario = self.scenario()
        figures = outcome(run_scenario(scenario))
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
