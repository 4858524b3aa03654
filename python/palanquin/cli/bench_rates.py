"""`palanquin bench rates`: what limits and prices of input rates add to a step."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.table import Table

from palanquin.cli.bench_options import Headless, JsonFile
from palanquin.cli.console import check_writable, err, out, reported_errors, write_json
from palanquin.schema import LAST_SEED

Repetitions = Annotated[int, typer.Option(min=1, max=1_000_000, help="Steps of each variant.")]
Seed = Annotated[int, typer.Option(min=0, max=LAST_SEED, help="Of the kicks, equal for all.")]


def rates(
    repetitions: Repetitions = 400,
    seed: Seed = 0,
    json_file: JsonFile = None,
    headless: Headless = False,
) -> None:
    """One real-time iteration of the same problem without rates and with them.

    "rate" states them by `problem.rate`, "link" as rows over two knots. Limits are there and not
    met; the ratio is to the step without rates that has the same bounds on inputs.
    """
    from palanquin.benchmarks.machine import describe_machine, source_revision
    from palanquin.benchmarks.suites.rates import run_rates

    with reported_errors():
        check_writable("--json", json_file)
        with err.status("lowering") as status:
            rows = run_rates(repetitions, seed, status.update)
        results = {"rows": rows, "machine": describe_machine(), "revision": source_revision()}
        write_json("--json", json_file, results)
    table = Table("states", "inputs", "rates", "median ms", "ratio", box=None)
    for row in rows:
        table.add_row(
            f"{row['states']}", f"{row['inputs']}", row["variant"], f"{row['median_ms']:.3g}",
            f"{row['ratio']:.2f}",
        )  # fmt: skip
    out.print(table)
