"""Runs of problems from starts by solvers, each judged at once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from palanquin.benchmarks.machine import describe_machine, source_revision
from palanquin.benchmarks.suites.certificate import KktError, kkt_error, violation_slope
from palanquin.benchmarks.suites.references import References
from palanquin.benchmarks.suites.solvers import Answer, Solver
from palanquin.benchmarks.suites.stated_program import StatedProgram
from palanquin.benchmarks.suites.verdict import excess, judge
from palanquin.problem import Problem
from palanquin.problems.collection import Ocp, Start
from palanquin.sim.runs.store import RowStore

Row = dict[str, Any]


def run_suite(
    ocps: list[Ocp],
    solvers: list[Solver],
    references: References,
    random: int,
    folder: Path,
    resume: bool,
    announce: Callable[[str], None],
) -> dict[str, Any]:
    """Every problem by every solver from rest, the line and `random` starts; `folder` keeps rows.

    Returns:
        {"rows": one a run, "machine": ..., "revision": ...}.
    """
    folder.mkdir(parents=True, exist_ok=True)
    revision = source_revision()
    store = RowStore(folder / "suites.jsonl", {"revision": revision}, resume)
    rows: list[Row] = []
    for ocp in ocps:
        rows += _run_problem(ocp, solvers, references.get(ocp.name, {}), random, store, announce)
    return {"rows": rows, "machine": describe_machine(), "revision": revision}


def _run_problem(
    ocp: Ocp,
    solvers: list[Solver],
    costs: dict[str, float],
    random: int,
    store: RowStore,
    announce: Callable[[str], None],
) -> list[Row]:
    problem, lowered = ocp.build(), ocp.build().lower()
    starts = ocp.starts(lowered, random)
    rows = []
    for solver in solvers:
        announce(f"{ocp.name}: {solver.name}")
        keys = {start: f"{ocp.name} / {start} / {solver.name}" for start in starts}
        if not all(key in store for key in keys.values()):
            solve = solver.prepare(ocp, lowered)
            for start, key in keys.items():
                if key not in store:
                    row = _judged(problem, starts[start], solve(starts[start]), costs, start)
                    names = {"problem": ocp.name, "start": start, "solver": solver.name}
                    store.add(key, names | row)
        rows += [store[key] for key in keys.values()]
    return rows


def _judged(
    problem: Problem, start: Start, answer: Answer, costs: dict[str, float], name: str
) -> Row:
    reference = costs.get(name, costs.get("best"))
    row: Row = {
        "status": answer.status,
        "message": answer.message,
        "iterations": answer.iterations,
        "milliseconds": answer.milliseconds,
        "reference": reference,
        "best": costs.get("best"),
        "cost": None,
    }
    error: KktError | None = None
    slope: float | None = None
    if answer.trajectory.size and np.isfinite(answer.trajectory).all():
        program = StatedProgram(problem, start.parameters, start.measured)
        at = program.expand(answer.trajectory)
        if at.is_finite:
            error = kkt_error(at)
            row |= {"cost": at.cost, **asdict(error)}
            row["excess"] = None if reference is None else excess(at.cost, reference)
            if answer.status == "infeasible":
                row["violation_slope"] = slope = violation_slope(at)
    row["verdict"] = str(judge(answer.status, error, row["cost"] or 0.0, reference, slope))
    return row
