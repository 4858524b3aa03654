"""`palanquin figures clm`: section IV of De Vincenti and Coros."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.progress import (
    BarColumn,
    Progress,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
)
from rich.table import Table

from palanquin.cli.bench_options import Folder, Headless, JsonFile
from palanquin.cli.console import (
    NOT_SOLVED,
    check_writable,
    err,
    out,
    prepare_folder,
    reported_errors,
    write_json,
)

if TYPE_CHECKING:
    from palanquin.benchmarks.clm_paper.reproduction import Progress as Report


class PaperTracking(StrEnum):
    """How plans are followed."""

    KINEMATIC = "kinematic"
    PHYSICS = "physics"


Seeds = Annotated[
    int | None,
    typer.Option(min=1, max=10_000, help="Runs of each experiment.", show_default="20, quick 2"),
]
Quick = Annotated[
    bool, typer.Option("--quick", help="About two minutes: few seeds, steps and cases.")
]
HowTracked = Annotated[
    PaperTracking,
    typer.Option(help="How plans are followed: as in the paper, or in full physics."),
]
Fresh = Annotated[bool, typer.Option("--fresh", help="Run again what the folder already holds.")]


def clm(
    seeds: Seeds = None,
    quick: Quick = False,
    fresh: Fresh = False,
    tracking: HowTracked = PaperTracking.KINEMATIC,
    folder: Folder = Path("out/figures-clm"),
    json_file: JsonFile = None,
    headless: Headless = False,
) -> None:
    """Push, ditches and ramp of De Vincenti and Coros, with their Figures 5 to 7 and a report; in
    physics without the rates, but with what limits them. What the folder holds from the same
    revision is taken up again.

    Exit status: 0 every run shows what is asked of it, 1 some do not, 2 bad input.
    """
    with reported_errors():
        from dataclasses import replace

        from palanquin.benchmarks.clm_paper.in_physics import reproduce_in_physics
        from palanquin.benchmarks.clm_paper.reproduction import QUICK, Effort, reproduce

        check_writable("--json", json_file)
        prepare_folder("--out", folder)
        effort = QUICK if quick else Effort()
        if seeds is not None:
            effort = replace(effort, seeds=seeds)
        columns = TextColumn("{task.description:<18}"), BarColumn(), TaskProgressColumn()
        with Progress(*columns, TimeElapsedColumn(), console=err) as bar:
            run = reproduce_in_physics if tracking is PaperTracking.PHYSICS else reproduce
            results, files = run(folder, effort, not fresh, _report(bar))
        write_json("--json", json_file, results)
    out.print(_table(results))
    for file in files:
        out.print(str(file), markup=False, highlight=False, soft_wrap=True)
    entries = [entry for group in results["criteria"].values() for entry in group]
    if any(entry["shown"] < entry["runs"] for entry in entries):
        raise typer.Exit(NOT_SOLVED)


def _report(bar: Progress) -> Report:
    """Shows each part on a bar of its own."""
    tasks: dict[str, TaskID] = {}

    def progress(name: str, done: float, total: float) -> None:
        if name not in tasks:
            tasks[name] = bar.add_task(name, total=total)
        bar.update(tasks[name], completed=done)

    return progress


def _table(results: dict[str, Any]) -> Table:
    table = Table("experiment", "asked of each run", "runs that show it", box=None)
    for name, entries in results["criteria"].items():
        for i, entry in enumerate(entries):
            label = name if i == 0 else ""
            table.add_row(label, entry["asked"], f"{entry['shown']} of {entry['runs']}")
    return table
