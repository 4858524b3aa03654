"""`palanquin check`: what derivatives, rows and costs of a problem say before it is solved."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from palanquin.cli.console import (
    NOT_SOLVED,
    check_writable,
    out,
    reported_errors,
    show_progress_of_lowering,
    write_json,
)
from palanquin.schema import LAST_SEED

Problem = Annotated[
    str,
    typer.Argument(
        metavar="PROBLEM",
        help="A case (JSON), a dump, the folder of a saved problem, a scenario or its file, a "
        "problem of the collection, or FILE.py:NAME for a Problem of your own, or a function "
        "that makes one.",
    ),
]
Points = Annotated[
    int, typer.Option(min=0, max=100, help="Random points besides the start's knots.")
]
Seed = Annotated[int, typer.Option(min=0, max=LAST_SEED, help="Of those.")]
Quick = Annotated[
    bool,
    typer.Option("--quick", help="Only what the SQP uses; not exact Hessians, nor Ipopt's."),
]
File = Annotated[Path | None, typer.Option("--json", help="File for the findings.")]


def check(
    problem: Problem,
    points: Points = 2,
    seed: Seed = 0,
    quick: Quick = False,
    file: File = None,
) -> None:
    """Holds every derivative of a problem against finite differences, and reports rank, curvature,
    scaling and what is not finite, at the knots that it would be solved from.

    Exit status: 0 nothing must be mended, 1 something must, 2 bad input.
    """
    from palanquin.cli.check_subjects import subjects
    from palanquin.code import KINDS

    with reported_errors():
        check_writable("--json", file)
        show_progress_of_lowering()
        reports = [
            subject.lowered.check(
                subject.parameters,
                subject.trajectory,
                random_points=points,
                seed=seed,
                libraries=("sqp",) if quick else KINDS,
            )
            for subject in subjects(problem)
        ]
        write_json("--json", file, [report.to_json() for report in reports])
    for report in reports:
        out.print(str(report), markup=False, highlight=False, soft_wrap=True)
    if not all(report.is_ok for report in reports):
        raise typer.Exit(NOT_SOLVED)
