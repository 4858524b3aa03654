"""`palanquin solve` for a dump: a solve that was written to one file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import typer

from palanquin import _core
from palanquin.cli.console import NOT_SOLVED, err, out, show_progress_of_lowering, write_json
from palanquin.cli.solve import summary
from palanquin.dump import read_dump
from palanquin.instance import Instance, Method
from palanquin.json_numbers import without_nan
from palanquin.plan import Plan, Status


def solve_dump(
    path: Path,
    solver: str | None,
    qp: str | None,
    iterations: int | None,
    penalty: bool,
    file: Path | None,
    explain: bool,
) -> None:
    """Solves a dump as it was solved, but for what options change.

    Raises ProblemError or LoweringError for a dump that cannot be used, ValueError for options that
    do not go with its solver.
    """
    dump = read_dump(path)
    show_progress_of_lowering()
    instance = dump.instance()
    plan, is_one_step = _solved(instance, solver, qp, iterations, penalty)
    is_solved = plan.status is Status.CONVERGED or (is_one_step and plan.is_usable)
    figures = _figures(plan)
    write_json("--out", file, figures)
    out.print(summary(path.stem, figures))
    if explain and is_solved:
        out.print(plan.explain(), markup=False, highlight=False, soft_wrap=True)
    recorded = dump.header.outcome or {}
    if "status" in recorded and recorded["status"] != plan.status.name:
        err.print(f"where it was dumped it ended as {recorded['status']}", markup=False)
    if not is_solved:
        err.print(f"not solved: {plan.message}", markup=False)
        err.print(plan.explain(), markup=False, highlight=False)
        raise typer.Exit(NOT_SOLVED)


def _solved(
    instance: Instance, solver: str | None, qp: str | None, iterations: int | None, penalty: bool
) -> tuple[Plan, bool]:
    """The plan, and whether one iteration was all that was asked for."""
    method: Method = (
        instance.method if solver is None else ("ipopt" if solver == "ipopt" else "sqp")
    )
    options: dict[str, Any] = {}
    if iterations is not None or solver == "rti":
        options["max_iterations"] = iterations or 1
    if qp is not None:
        if method == "ipopt":
            raise ValueError("--qp: Ipopt has no QP back end")
        options["qp"] = qp
    if penalty and method == "ipopt":
        options["penalize"] = True
    if method != instance.method:
        settings = _core.IpoptSettings() if method == "ipopt" else _core.SqpSettings()
        instance = replace(instance, method=method, settings=settings, predicted=None)
    steps = options.get("max_iterations", instance.settings.max_iterations)
    return instance.solve(**options), steps == 1 and method == "sqp"


def _figures(plan: Plan) -> dict[str, Any]:
    figures = {
        "status": plan.status.name.lower(),
        "message": plan.message,
        "cost": plan.cost,
        "tracking_cost": plan.tracking_cost,
        "penalty_cost": plan.penalty_cost,
        "equality_violation": plan.equality_violation,
        "inequality_violation": dict(plan.violation),
        "iterations": plan.iteration_count,
        "time_ms": plan.timings_ms["total"],
        "trajectory": {name: plan.trajectory[name].tolist() for name in plan.trajectory},
    }
    return without_nan(figures)
