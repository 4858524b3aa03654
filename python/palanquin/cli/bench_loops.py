"""`palanquin bench loops`: one SQP iteration a period against solving to convergence."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import typer
from rich.table import Table

from palanquin.cli.bench_options import Headless, JsonFile
from palanquin.cli.bench_options import chosen as chosen_names
from palanquin.cli.console import check_writable, err, out, reported_errors, write_json
from palanquin.schema import LAST_SEED

Problems = Annotated[
    str, typer.Option(metavar="NAME,...", help="Such as pendulum,carrying; all unless told.")
]
Controllers = Annotated[str, typer.Option(metavar="NAME,...", help="Such as one; all unless told.")]
Steps = Annotated[
    int, typer.Option(min=0, max=1_000_000, help="Periods of each loop; its own unless told.")
]
Repetitions = Annotated[
    int, typer.Option(min=1, max=100, help="Of each loop; a period's least time counts.")
]
Seed = Annotated[int, typer.Option(min=0, max=LAST_SEED, help="Of the kicks, equal for all.")]


def loops(
    problems: Problems = "",
    controllers: Controllers = "",
    steps: Steps = 0,
    repetitions: Repetitions = 1,
    seed: Seed = 0,
    json_file: JsonFile = None,
    headless: Headless = False,
) -> None:
    """Closed loops with one SQP iteration a period, in one phase and in two.

    With hard rows and with penalties; the column "cost" is relative to the loop in which every
    period is solved to convergence. "dropped" counts plans that do not start where was measured;
    "p50 ms" is the solver's own time, and the next columns are multiples of it.
    """
    from palanquin.benchmarks.machine import describe_machine, source_revision
    from palanquin.benchmarks.suites.all_loops import LOOPS, run_loops
    from palanquin.benchmarks.suites.loops import CONTROLLERS

    with reported_errors():
        check_writable("--json", json_file)
        names = chosen_names("--problems", problems, [loop.problem for loop in LOOPS])
        chosen = [loop for loop in LOOPS if loop.problem in names]
        if steps:
            chosen = [replace(loop, steps=steps) for loop in chosen]
        names = chosen_names("--controllers", controllers, [by.name for by in CONTROLLERS])
        with err.status("lowering") as status:
            by = tuple(by for by in CONTROLLERS if by.name in names)
            rows = run_loops(chosen, seed, status.update, by, repetitions)
        results = {"rows": rows, "machine": describe_machine(), "revision": source_revision()}
        write_json("--json", json_file, results)
    out.print(_table(rows))


def _table(rows: list) -> Table:  # type: ignore[type-arg]
    table = Table(
        "loop",
        "rows",
        "controller",
        "cost",
        "violation",
        "dropped",
        "unusable",
        "p50 ms",
        "p99",
        "p99.9",
        "max",
        box=None,
    )
    for row in rows:
        ratio = "" if row["cost_ratio"] is None else f"{row['cost_ratio']:.5f}"
        ratio = "diverged" if row["cost"] is None else ratio
        violation = "" if row["violation"] is None else f"{row['violation']:.1e}"
        counts = (f"{row[name]}/{row['steps']}" for name in ("dropped", "unusable"))
        times = row["solve_ms"]
        tail = (f"{times[name] / times['p50']:.1f}x" for name in ("p99", "p99.9", "max"))
        names = (row["loop"], row["limits"], row["controller"])
        table.add_row(*names, ratio, violation, *counts, f"{times['p50']:.3f}", *tail)
    return table
