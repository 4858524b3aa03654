"""Runs of experiments from several seeds; finished ones are taken up again."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palanquin.benchmarks.clm_paper.experiments import Experiment
from palanquin.benchmarks.clm_paper.figures_of_runs import Row, figures_of
from palanquin.sim.runs.loop import number_of_ticks
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.runs.store import RowStore
from palanquin.sim.scenarios import Scenario


@dataclass(frozen=True)
class Runs:
    """Rows of an experiment, one a seed, and the rollout of the first seed, for pictures."""

    experiment: Experiment
    rows: list[Row]
    first: Record

    @property
    def scenario(self) -> Scenario:
        """The scenario of the first seed."""
        return self.experiment.scenario.changed(seed=0)


class SeedRunner:
    """Runs experiments seed by seed and keeps what is done in a folder.

    A row is taken up again when its scenario and the conditions are the same, so a command that was
    cut off goes on where it was.

    Args:
        folder: for `rows.jsonl` and the first seeds' rollouts.
        conditions: what makes rows comparable beyond the scenario, for example the revision.
        seeds: how many runs an experiment has, at least 1.
        resume: keep what the folder already holds.
    """

    def __init__(self, folder: Path, conditions: dict[str, Any], seeds: int, resume: bool) -> None:
        self._store = RowStore(folder / "rows.jsonl", conditions, resume)
        self._folder = folder / "rollouts"
        self._folder.mkdir(parents=True, exist_ok=True)
        self._stamp = hashlib.sha256(json.dumps(conditions, sort_keys=True).encode()).hexdigest()
        self._seeds = seeds

    def count(self, experiment: Experiment) -> int:
        """How many runs an experiment has."""
        return min(self._seeds, experiment.seeds or self._seeds)

    def ticks(self, experiment: Experiment) -> int:
        """How many ticks all of them take."""
        scenario = experiment.scenario
        return self.count(experiment) * number_of_ticks(scenario.duration, scenario.planner.period)

    def run(self, experiment: Experiment, progress: Callable[[int], None]) -> Runs:
        """Runs what is missing; `progress` is told how many ticks more are done."""
        scenarios = [experiment.scenario.changed(seed=s) for s in range(self.count(experiment))]
        file = self._rollout_file(experiment, scenarios[0])
        for scenario in scenarios:
            key = _key(experiment, scenario)
            ticks = number_of_ticks(scenario.duration, scenario.planner.period)
            if key in self._store and (scenario.seed > 0 or file.exists()):
                progress(ticks)
                continue
            done = 0

            def advance(tick: int) -> None:
                nonlocal done
                progress(tick - done)
                done = tick

            rollout = run_scenario(scenario, progress=advance)
            progress(ticks - done)
            if scenario.seed == 0:
                part = file.with_name(f"part-{file.name}")  # a file that is there is whole
                rollout.save(part)
                part.replace(file)
            row = {**figures_of(scenario, rollout), **experiment.measure(scenario, rollout)}
            self._store.add(key, row)
        rows = [self._store[_key(experiment, scenario)] for scenario in scenarios]
        return Runs(experiment, rows, Record.load(file))

    def _rollout_file(self, experiment: Experiment, scenario: Scenario) -> Path:
        name = hashlib.sha256((_key(experiment, scenario) + self._stamp).encode()).hexdigest()[:12]
        return self._folder / f"{experiment.name}-{name}.npz"


def _key(experiment: Experiment, scenario: Scenario) -> str:
    content = scenario.model_dump_json(exclude={"summary"})
    return f"{experiment.name} {hashlib.sha256(content.encode()).hexdigest()[:16]}"
