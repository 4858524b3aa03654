"""Runs over many seeds, which can be stopped and continued."""

from __future__ import annotations

import math
import signal
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from palanquin.sim.errors import InputError
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.runs.store import RowStore
from palanquin.sim.scenarios.bar_forces import Force
from palanquin.sim.scenarios.bars import PLANNERS, BarScenario
from palanquin.sim.scenarios.files import load_scenario
from palanquin.sim.scenarios.library import SUITES as SUITE_FOLDER

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
    """One run of a campaign."""

    suite: str
    planner: str
    seed: int

    @property
    def key(self) -> str:
        """Under which its figures are kept."""
        return f"{self.suite} {self.planner} {self.seed}"

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


class AnyTrial(Protocol):
    """One run of a campaign of any kind; pickled on its way to another process."""

    @property
    def key(self) -> str:
        """Under which its figures are kept."""

    def run(self) -> dict[str, Any]:
        """Its figures."""


def missing_of(wanted: Sequence[AnyTrial], results: RowStore) -> list[AnyTrial]:
    """Those of `wanted` whose figures are not kept yet."""
    return [trial for trial in wanted if trial.key not in results]


def run_trials(
    wanted: Sequence[AnyTrial], results: RowStore, jobs: int
) -> Iterator[dict[str, Any]]:
    """Runs what is missing in `jobs` processes, keeps figures as they come and yields them.

    A line that a stop has cut off is dropped, and its trial runs again.
    """
    if jobs < 1:
        raise InputError(f"jobs: {jobs} must be at least 1")
    missing = missing_of(wanted, results)
    if not missing:
        return
    workers = min(jobs, len(missing))
    with ProcessPoolExecutor(workers, initializer=_leave_interrupts_to_parent) as pool:
        trials_of = {pool.submit(trial.run): trial for trial in missing}
        try:
            for future in as_completed(trials_of):
                row = future.result()
                results.add(trials_of[future].key, row)
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
