"""`palanquin solve`: one optimal control problem from a file, a case or a dump."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from palanquin.cli.console import (
    NOT_SOLVED,
    check_writable,
    err,
    out,
    reported_errors,
    show_progress_of_lowering,
    write_json,
    writing,
)


class Solver(StrEnum):
    """The methods that a case may be solved with."""

    RTI = "rti"
    SQP = "sqp"
    IPOPT = "ipopt"


Case = Annotated[
    Path,
    typer.Argument(metavar="FILE", help="One problem instance: a case (JSON), or a dump."),
]
SolverOption = Annotated[
    Solver | None,
    typer.Option(
        help="One SQP iteration, SQP to convergence, or Ipopt.  [default: sqp, or the dump's]",
        show_default=False,
    ),
]
Qp = Annotated[str | None, typer.Option(help="Back end of the SQP's subproblem.")]
Iterations = Annotated[int | None, typer.Option(min=1, max=1_000_000, help="Iteration limit.")]
Penalty = Annotated[
    bool, typer.Option("--penalty", help="Ipopt with penalties; the SQP always has them.")
]
Starts = Annotated[
    int, typer.Option(min=1, max=1000, help="Foothold choices to try where ditches leave some.")
]
File = Annotated[Path | None, typer.Option("--out", help="JSON file for the result.")]
Explain = Annotated[
    bool, typer.Option("--explain", help="Explain the plan also where it is solved.")
]
Dump = Annotated[
    Path | None,
    typer.Option(
        "--dump-on-failure",
        metavar="FILE",
        help="Where to write a solve that failed, as one file to be solved elsewhere.",
    ),
]


def solve(
    case: Case,
    solver: SolverOption = None,
    qp: Qp = None,
    iterations: Iterations = None,
    penalty: Penalty = False,
    starts: Starts = 16,
    file: File = None,
    explain: Explain = False,
    dump: Dump = None,
) -> None:
    """Solves one problem instance and says why the solver stopped.

    Exit status: 0 solved, 1 not solved (the result is written all the same), 2 bad input.
    """
    from palanquin.cli.solve_dump import solve_dump
    from palanquin.dump import is_dump
    from palanquin.problems.case_files import read_case
    from palanquin.problems.layered.case import is_layered

    with reported_errors():
        check_writable("--out", file)
        check_writable("--dump-on-failure", dump)
        if is_dump(case):
            method = solver and solver.value
            solve_dump(case, method, qp, iterations, penalty, file, explain)
            return
        data = read_case(case)
        if not is_layered(data):
            options = ((solver or Solver.SQP).value, qp, iterations, penalty, starts)
            _solve_team(case, data, options, file, explain, dump)
            return
        if dump is not None:
            raise ValueError("--dump-on-failure does not take robots on bars")
        _solve_layered(case, data, qp, file)


def _solve_team(
    case: Path, data: Any, options: Any, file: Path | None, explain: bool, dump: Path | None
) -> None:
    """One instant of a team with its payload; `options` are those of `solve_case`."""
    from palanquin.problems.clm import parse_case
    from palanquin.problems.clm.solve import CaseResult, solve_case

    problem = parse_case(data, str(case))
    show_progress_of_lowering()
    result: CaseResult = solve_case(problem, *options)
    figures = result.to_json()
    write_json("--out", file, figures)
    if dump is not None and not result.solved:
        with writing("--dump-on-failure", dump):
            result.plan.dump(dump)
    out.print(summary(case.stem, figures))
    if explain and result.solved:
        out.print(result.plan.explain(), markup=False, highlight=False, soft_wrap=True)
    if not result.solved:
        err.print(f"not solved: {figures['message']}", markup=False)
        err.print(result.plan.explain(), markup=False, highlight=False)
        raise typer.Exit(NOT_SOLVED)


def _solve_layered(case: Path, data: Any, qp: str | None, file: Path | None) -> None:
    """One instant of robots on a bar: a linear MPC, one QP for each planner."""
    from palanquin.problems.layered.case import parse_layered_case
    from palanquin.problems.layered.solve import solve_layered_case

    problem = parse_layered_case(data, str(case))
    show_progress_of_lowering()
    result = solve_layered_case(problem, qp)
    figures = result.to_json()
    write_json("--out", file, figures)
    table = Table(title=case.stem, show_header=False)
    for key in ("status", "message"):
        table.add_row(key, figures[key])
    for planner in ("centralized", "nominal", "distributed"):
        table.add_row(f"cost, {planner}", str(figures[planner]["cost"]))
    out.print(table)
    if not result.solved:
        err.print(f"not solved: {result.message}", markup=False)
        raise typer.Exit(NOT_SOLVED)


def summary(name: str, figures: dict) -> Table:  # type: ignore[type-arg]
    """Figures of a solve as a table."""
    table = Table(title=name, show_header=False)
    for key in ("status", "message", "cost", "tracking_cost", "penalty_cost"):
        table.add_row(key, _number(figures[key]))
    table.add_row("equality_violation", _number(figures["equality_violation"]))
    for family, value in figures["inequality_violation"].items():
        table.add_row(f"violation: {family}", _number(value))
    table.add_row("iterations", str(figures["iterations"]))
    table.add_row("time_ms", _number(figures["time_ms"]))
    return table


def _number(value: object) -> str:
    return f"{value:.9g}" if isinstance(value, float) else str(value)
