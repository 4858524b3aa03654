"""`palanquin bench whole-body`: our solver of the controllers' small QPs against others."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from rich.table import Table

from palanquin.cli.bench_options import Headless, JsonFile
from palanquin.cli.console import check_writable, err, out, reported_errors, write_json


def whole_body(
    problems: Annotated[
        int, typer.Option(min=1, max=100_000, help="QPs that each solver gets of each course.")
    ] = 300,
    json_file: JsonFile = None,
    headless: Headless = False,
) -> None:
    """The whole-body controllers' QPs, recorded in runs of robots on a bar, by several solvers.

    The others are an extra, `pip install 'palanquin[peers]'`; those that are not there are left
    out, by name. All start from scratch.
    """
    from palanquin.benchmarks.machine import describe_machine, source_revision
    from palanquin.benchmarks.whole_body.comparison import compare, installed_peers

    with reported_errors():
        check_writable("--json", json_file)
        peers, missing = installed_peers()
        for name in missing:
            err.print(f"{name} is skipped: pip install 'palanquin[peers]'", markup=False)
        with err.status("recording and solving"):
            rows = compare(problems, peers)
        machine = {"machine": describe_machine(), "revision": source_revision()}
        write_json("--json", json_file, {"rows": rows, **machine})
    out.print(_table(rows))


def _table(rows: list[dict[str, Any]]) -> Table:
    table = Table(
        "course", "solver", "p50", "p95", "p99", "max", "call p50", "cost gap", "violation",
        "failed", box=None, title="microseconds a QP",
    )  # fmt: skip
    last = ""
    for row in rows:
        inside, call = row["inside_us"] or {}, row["call_us"] or {}
        table.add_row(
            row["course"] if row["course"] != last else "",
            row["solver"],
            *(f"{inside[q]:.1f}" if q in inside else "" for q in ("p50", "p95", "p99", "max")),
            f"{call['p50']:.1f}" if call else "",
            f"{row['cost_gap']:.0e}", f"{row['violation']:.0e}", str(row["failures"]),
        )  # fmt: skip
        last = row["course"]
    return table
