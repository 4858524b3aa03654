"""`palanquin bench loops`: one SQP iteration a period against solving to convergence."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from palanquin.cli.console import check_writable, err, out, reported_errors, write_json
from palanquin.errors import ProblemError
from palanquin.schema import LAST_SEED


def loops(
    problems: Annotated[
        str, typer.Option(metavar="NAME,...", help="Such as pendulum,carrying; all unless told.")
    ] = "",
    seed: Annotated[
        int, typer.Option(min=0, max=LAST_SEED, help="Of the kicks, equal for all.")
    ] = 0,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="For all rows.")
    ] = None,
    headless: Annotated[
        bool, typer.Option("--headless", help="Open no window; benchmarks never do.")
    ] = False,
) -> None:
    """Closed loops with one SQP iteration a period, in one phase and in two.

    With hard rows and with penalties; the column "cost" is relative to the loop in which every
    period is solved to convergence. "dropped" counts plans that do not start where was measured.
    """
    from palanquin.benchmarks.machine import describe_machine, source_revision
    from palanquin.benchmarks.suites.all_loops import LOOPS, run_loops

    with reported_errors():
        check_writable("--json", json_file)
        names = [name.strip() for name in problems.split(",") if name.strip()]
        known = dict.fromkeys(loop.problem for loop in LOOPS)
        for name in names:
            if name not in known:
                raise ProblemError(f"--problems {name!r} is unknown; there are {', '.join(known)}")
        chosen = [loop for loop in LOOPS if not names or loop.problem in names]
        with err.status("lowering") as status:
            rows = run_loops(chosen, seed, status.update)
        results = {"rows": rows, "machine": describe_machine(), "revision": source_revision()}
        write_json("--json", json_file, results)
    out.print(_table(rows))


def _table(rows: list) -> Table:  # type: ignore[type-arg]
    table = Table(
        "loop", "rows", "controller", "cost", "violation", "dropped", "unusable", box=None
    )
    for row in rows:
        ratio = "diverged" if row["cost_ratio"] is None else f"{row['cost_ratio']:.5f}"
        violation = "" if row["violation"] is None else f"{row['violation']:.1e}"
        counts = (f"{row[name]}/{row['steps']}" for name in ("dropped", "unusable"))
        table.add_row(row["loop"], row["limits"], row["controller"], ratio, violation, *counts)
    return table
