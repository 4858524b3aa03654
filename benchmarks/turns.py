"""Measuring variants in turns."""

from __future__ import annotations

import gc
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TypeVar

from palanquin.benchmarks.runs import Run, Step

Key = TypeVar("Key")


@dataclass
class Record:
    """The steps that a run has taken, and the error that ended it early, if one did."""

    steps: list[Step] = field(default_factory=list)
    error: str = ""


def take_turns(
    runs: Mapping[Key, Run],
    steps: int,
    turn: int,
    skip: int,
    progress: Callable[[], None] = lambda: None,
) -> dict[Key, Record]:
    """Lets every run take `turn` steps, then the next one, until each has taken `skip + steps`.

    A run that raises an error is out; the others go on.

    Args:
        runs: what to measure.
        steps: how many steps of each are recorded.
        turn: steps in a row. After another variant the first of them finds its data gone from the
            processor's caches, so a turn of 1 measures memory more than work.
        skip: steps at the beginning that are not recorded.
        progress: called after every step.
    """
    records: dict[Key, Record] = {key: Record() for key in runs}
    total = skip + steps
    gc.disable()
    try:
        for first in range(0, total, turn):
            for key, run in runs.items():
                _take_turn(run, records[key], min(turn, total - first), progress)
            gc.collect()
    finally:
        gc.enable()
    for record in records.values():
        del record.steps[:skip]
    return records


def _take_turn(run: Run, record: Record, steps: int, progress: Callable[[], None]) -> None:
    for _ in range(steps):
        if not record.error:
            try:
                record.steps.append(run.step())
            except (ValueError, ArithmeticError, RuntimeError) as error:
                record.error = f"{type(error).__name__}: {error}"
        progress()
