"""Measuring variants, those of a team size in turns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palanquin.benchmarks.machine import describe_machine, source_revision
from palanquin.benchmarks.rows import make_row
from palanquin.benchmarks.runs import converged_cost, start_run
from palanquin.benchmarks.turns import Record, take_turns
from palanquin.benchmarks.variant import Variant
from palanquin.errors import ProblemError
from palanquin.sim.runs.store import RowStore

Row = dict[str, Any]

TURN = 10  # steps in a row
WARM_UP = 10  # steps before the first recorded one
COLD_FRACTION = 10  # a cold solve takes about this many times as long as a step


@dataclass(frozen=True)
class Measurement:
    """How to measure.

    Attributes:
        steps: recorded steps of a warm variant; a cold one takes a tenth of them, at least 3.
        seed: of the disturbances.
        folder: where finished rows are kept.
        resume: whether rows that are there already are taken over.
    """

    steps: int
    seed: int
    folder: Path
    resume: bool = False

    def __post_init__(self) -> None:
        if self.steps < 1:
            raise ProblemError(f"--repetitions {self.steps}: at least one step is needed")

    def steps_of(self, variant: Variant) -> int:
        """How many steps of a variant are recorded."""
        return self.steps if variant.start == "warm" else max(3, self.steps // COLD_FRACTION)

    def total(self, variants: list[Variant]) -> int:
        """How often `progress` will be called."""
        return sum(self.steps_of(v) + (WARM_UP if v.start == "warm" else 0) for v in variants)

    def run(
        self,
        variants: list[Variant],
        progress: Callable[[int], None] = lambda steps: None,
        announce: Callable[[str], None] = lambda text: None,
    ) -> dict[str, Any]:
        """Measures; returns {"rows", "machine", "revision"}, rows in the order of `variants`.

        All variants of one team size and start take turns, so that ratios between them, and slopes
        over horizons, mean something on a machine whose speed drifts. Their rows are kept as soon
        as all of them are done. `progress` is told how many steps have been done since the last
        call.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        revision = source_revision()
        machine = describe_machine(max((v.threads for v in variants), default=1))
        conditions = {"steps": self.steps, "seed": self.seed, "revision": revision}
        store = RowStore(self.folder / "rows.jsonl", conditions, self.resume)
        for robots, start in dict.fromkeys((v.task.robots, v.start) for v in variants):
            group = [v for v in variants if (v.task.robots, v.start) == (robots, start)]
            missing = [v for v in group if v.key not in store]
            progress(self.total(group) - self.total(missing))
            if missing:
                announce(f"{robots} robots, {start}")
                self._measure(missing, store, lambda: progress(1))
        rows = [store[v.key] for v in variants]
        return {"rows": rows, "machine": machine, "revision": revision}

    def _measure(
        self, variants: list[Variant], store: RowStore, progress: Callable[[], None]
    ) -> None:
        """Variants of one team size and start."""
        is_warm = variants[0].start == "warm"
        steps, skip = self.steps_of(variants[0]), WARM_UP if is_warm else 0
        runs = {v: start_run(v, self.seed) for v in variants}
        records: dict[Variant, Record] = take_turns(runs, steps, TURN, skip, progress)
        best = {
            task: converged_cost(task, steps, skip, self.seed) if is_warm else None
            for task in dict.fromkeys(v.task for v in variants)
        }
        for variant, record in records.items():
            flops = runs[variant].flops() if record.steps else None
            store.add(variant.key, make_row(variant, record, best[variant.task], flops))
