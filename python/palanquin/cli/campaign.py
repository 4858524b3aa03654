"""`palanquin campaign`: many runs, success rates."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from palanquin.cli.console import check_writable, err, out, prepare_folder, reported_errors

app = typer.Typer(help="Runs a suite over many seeds; a stopped one goes on.", no_args_is_help=True)


@app.callback()
def campaign() -> None:
    """Runs a suite over many seeds; a stopped one goes on where it was."""


Suite = Annotated[
    str,
    typer.Option(
        help="flat (30 s; 0, 5, 6.8 kg), rough (10 m of 5 cm, 5 kg, 20 N), rougher (12 cm), "
        "slippery (friction 0.3), sin40 and sin60 (sinusoids on all axes, N), axis40 and "
        "axis60 (on one axis), or opposed (30 N)."
    ),
]
Planners = Annotated[
    str, typer.Option(help="Some of centralized, distributed, nominal, with commas.")
]
Seeds = Annotated[int, typer.Option(min=1, max=10_000, help="Seeds 1 to this one.")]
Jobs = Annotated[int, typer.Option(min=1, max=256, help="Processes.")]
Results = Annotated[
    Path | None,
    typer.Option("--json", help="Results, one line a run; continued if it exists."),
]


@app.command()
def bar(
    suite: Suite = "flat",
    planners: Planners = "centralized,distributed",
    seeds: Seeds = 20,
    jobs: Jobs = 2,
    json_file: Results = None,
) -> None:
    """Walks A1s on a bar over many seeds, in full physics, and counts who arrives.

    The results' file grows by a line with every finished run: the same command continues it.
    Exit status: 0 all runs done (whether or not the robots fell), 2 bad input.
    """
    with reported_errors():
        from palanquin.sim.runs import campaign as campaigns
        from palanquin.sim.runs.store import RowStore

        check_writable("--json", json_file)
        path = json_file or Path("out") / "campaign" / f"bar-{suite}.jsonl"
        wanted = campaigns.trials(suite, tuple(planners.split(",")), seeds)
        if json_file is None:
            prepare_folder("--json", path.parent)
        results = RowStore(path, {}, resume=True)
        columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()
        with Progress(*columns, TimeRemainingColumn(), console=err, transient=True) as progress:
            done = len(wanted) - len(campaigns.missing_of(wanted, results))
            task = progress.add_task(suite, total=len(wanted), completed=done)
            for _ in campaigns.run_trials(wanted, results, jobs):
                progress.advance(task)
        chosen = [row for row in results.rows if row.get("suite") == suite]
        out.print(_table(campaigns.summary(chosen)))
        out.print(f"results: {path}", markup=False, highlight=False, soft_wrap=True)


def _table(rows: list[dict[str, Any]]) -> Table:
    table = Table()
    for title in ("suite", "planner", "completed", "velocity rms, worst", "bar's error, torque"):
        table.add_column(title)
    for row in rows:
        table.add_row(
            row["suite"],
            row["planner"],
            f"{row['completed']} of {row['trials']}",
            f"{row['velocity_rms_worst']:.3f} m/s",
            f"{1e3 * row['bar_length_error_max']:.2g} mm, {100 * row['torque_fraction_max']:.0f} %",
        )
    return table
