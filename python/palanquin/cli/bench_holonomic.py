"""`palanquin bench holonomic`: how long the planners of robots on a bar take."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.table import Table

from palanquin.cli.bench_options import Headless, JsonFile
from palanquin.cli.console import check_writable, err, out, reported_errors, write_json

Samples = Annotated[int, typer.Option(min=10, max=1_000_000, help="Plans of each planner.")]
Problems = Annotated[int, typer.Option(min=1, max=10_000, help="QPs that each other solver gets.")]


def holonomic(
    samples: Samples = 2000,
    problems: Problems = 20,
    json_file: JsonFile = None,
    headless: Headless = False,
) -> None:
    """Two robots on a bar: centralized, distributed and nominal planner, and other QP solvers.

    A closed loop on the reduced-order plant, with an unknown payload and sinusoids of 40 N, so that
    friction rows are active now and then. Other solvers get the same QPs through CasADi.
    """
    from palanquin.benchmarks.layered.timing import PAPER_MS, Row, measure_peers, measure_planners
    from palanquin.benchmarks.machine import describe_machine, source_revision

    with reported_errors():
        check_writable("--json", json_file)
        rows: list[Row] = []
        with err.status("measuring") as status:
            for row in measure_planners(samples, ("structured",)):
                rows.append(row)
                status.update(f"{row.planner}, {row.solver}")
            rows += measure_planners(min(samples, 100), ("osqp",))
            for row in measure_peers(problems):
                rows.append(row)
                status.update(f"{row.planner}, {row.solver}")
        results = {
            "rows": [row.to_json() for row in rows],
            "paper_ms": PAPER_MS,
            "machine": describe_machine(),
            "revision": source_revision(),
        }
        write_json("--json", json_file, results)
    out.print(_table(rows))
    out.print(f"The paper's machine: {PAPER_MS} ms.", markup=False)


def _table(rows: list) -> Table:  # type: ignore[type-arg]
    table = Table("planner", "QP solver", "phase", "p50", "p95", "p99", "max", "note", box=None)
    for row in rows:
        figures = row.to_json()
        gap = "" if row.cost_gap is None else f"cost within {row.cost_gap:.0e}"
        failed = f"{row.times.failures} failed" if row.times.failures else ""
        note = ", ".join(filter(None, (gap, failed, row.note)))
        phases = [p for p in ("build_ms", "solve_ms", "total_ms") if p in figures]
        for i, phase in enumerate(phases or ["none"]):
            marks = figures.get(phase, {})
            head = (row.planner, row.solver) if i == 0 else ("", "")
            table.add_row(
                *head, phase.removesuffix("_ms"),
                *(f"{marks[q]:.3f}" if q in marks else "" for q in ("p50", "p95", "p99", "max")),
                note if i == 0 else "",
            )  # fmt: skip
    return table
