"""`palanquin campaign`: many runs, success rates."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from palanquin.cli.console import check_writable, err, out, prepare_folder, reported_errors

if TYPE_CHECKING:
    from palanquin.sim.runs.campaign import AnyTrial
    from palanquin.sim.runs.store import RowStore

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

        wanted = campaigns.trials(suite, tuple(planners.split(",")), seeds)
        results, path = _run(f"bar-{suite}", wanted, json_file, jobs)
        chosen = [row for row in results.rows if row.get("suite") == suite]
        out.print(_table(campaigns.summary(chosen)))
        out.print(f"results: {path}", markup=False, highlight=False, soft_wrap=True)


HandsSuite = Annotated[
    str,
    typer.Option(
        help="push-stand, push-trot (0.4 m/s), push-three (robots), push-slope (22 degrees): one "
        "robot is pushed for 0.8 s, direction, instant and robot random; payload (kg, the planner "
        "is told 16), robots (share of the masses told)."
    ),
]
Values = Annotated[str, typer.Option("--at", help="Newtons, kg or shares, with commas.")]
Without = Annotated[
    str, typer.Option(help="Planned without some of leg_torque, arm_torque, observers.")
]
Period = Annotated[float, typer.Option(min=0, help="Of the gait, s; its own unless told.")]


@app.command()
def hands(
    suite: HandsSuite = "push-trot",
    at: Values = "164",
    without: Without = "",
    period: Period = 0.0,
    seeds: Seeds = 20,
    jobs: Jobs = 2,
    json_file: Results = None,
) -> None:
    """Pushes armed teams, or gives them unknown masses, over many seeds in full physics.

    The results' file grows by a line with every finished run: the same command continues it.
    Exit status: 0 all runs done (whether or not the robots fell), 2 bad input.
    """
    with reported_errors():
        from palanquin.sim.runs import hands_campaign as campaigns

        values = tuple(float(value) for value in at.split(","))
        remedies = tuple(name for name in without.split(",") if name)
        wanted = campaigns.hands_trials(suite, values, remedies, period, seeds)
        results, path = _run(f"hands-{suite}", wanted, json_file, jobs)
        keys = [trial.key for trial in wanted]
        out.print(_hands_table(suite, campaigns.hands_summary([results[key] for key in keys])))
        out.print(f"results: {path}", markup=False, highlight=False, soft_wrap=True)


def _run(
    name: str, wanted: Sequence[AnyTrial], json_file: Path | None, jobs: int
) -> tuple[RowStore, Path]:
    """Runs what is missing in the results' file."""
    from palanquin.sim.runs.campaign import missing_of, run_trials
    from palanquin.sim.runs.store import RowStore

    check_writable("--json", json_file)
    path = json_file or Path("out") / "campaign" / f"{name}.jsonl"
    if json_file is None:
        prepare_folder("--json", path.parent)
    results = RowStore(path, {}, resume=True)
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()
    with Progress(*columns, TimeRemainingColumn(), console=err, transient=True) as progress:
        done = len(wanted) - len(missing_of(wanted, results))
        task = progress.add_task(name, total=len(wanted), completed=done)
        for _ in run_trials(wanted, results, jobs):
            progress.advance(task)
    return results, path


def _hands_table(suite: str, rows: list[dict[str, Any]]) -> Table:
    table = Table(title=f"{suite}: payload's largest errors in mm, backward pushes apart")
    for title in ("at", "without", "period", "completed", "backwards", "away", "height", "end"):
        table.add_column(title)
    for row in rows:
        away = (row["payload_max_m"], row["payload_max_backwards_m"])
        table.add_row(
            f"{row['value']:g}",
            row["without"].replace(",", "\n"),
            f"{row['period']:g}" if row["period"] else "",
            f"{row['completed']} of {row['trials']}",
            row["backwards"],
            " / ".join(f"{1e3 * value:.1f}" for value in away),
            f"{1e3 * row['height_max_m']:.1f}",
            f"{1e3 * row['payload_end_m']:.1f}",
        )
    return table


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
