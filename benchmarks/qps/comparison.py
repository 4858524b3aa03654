"""`palanquin bench qps`: every QP of a folder by every solver, judged by one KKT error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from palanquin.benchmarks.machine import describe_machine, source_revision
from palanquin.benchmarks.qps.solvers import Solver, Task
from palanquin.benchmarks.suites.report import draw_profile
from palanquin.benchmarks.suites.verdict import Verdict
from palanquin.errors import ProblemError
from palanquin.qp_files import FORMATS, read_qp

SOLVED = 1e-6  # KKT error, scaled
Row = dict[str, Any]


def qp_paths(folder: Path) -> list[Path]:
    """The files of known formats below a folder; ProblemError if there are none."""
    paths = sorted(path for path in folder.rglob("*") if path.suffix in FORMATS)
    if not paths:
        raise ProblemError(f"{folder} holds no file that ends in {', '.join(FORMATS)}")
    return paths


def run_qps(
    paths: Sequence[Path],
    solvers: dict[str, Solver],
    repetitions: int,
    announce: Callable[[str], None] = lambda text: None,
) -> dict[str, Any]:
    """Solvers take turns on each QP.

    Returns:
        {"rows": one a QP and solver, "skipped": {file: why}, "machine", "revision"}.
    """
    rows: list[Row] = []
    skipped: dict[str, str] = {}
    for path in paths:
        announce(path.name)
        try:
            task = Task.of(read_qp(path))
        except ProblemError as error:
            skipped[path.name] = str(error)
            continue
        rows += _rows(path, task, solvers, repetitions)
    machine, revision = describe_machine(), source_revision()
    return {"rows": rows, "skipped": skipped, "machine": machine, "revision": revision}


def _rows(path: Path, task: Task, solvers: dict[str, Solver], repetitions: int) -> list[Row]:
    ready = {}
    rows = {name: _row(path, task, name) for name in solvers if name != "hpipm" or task.has_stages}
    for name, row in rows.items():
        try:
            ready[name] = solvers[name](task)
        except Exception as error:  # a peer's own, of whatever kind
            row["failure"] = f"{type(error).__name__}: {error}"
    times: dict[str, list[float]] = {name: [] for name in ready}
    for _ in range(1 + repetitions):  # the first one warms up
        for name in [*ready]:
            try:
                answer = ready[name]()
            except Exception as error:  # as above
                rows[name]["failure"] = f"{type(error).__name__}: {error}"
                del ready[name]
                continue
            times[name].append(answer.ms)
            kkt = task.general.error(answer.x, answer.y).max
            rows[name]["kkt_error"] = kkt if np.isfinite(kkt) else None
            rows[name]["cost"] = task.general.cost(answer.x) if np.isfinite(kkt) else None
            rows[name]["failure"] = answer.failure
            rows[name]["solved"] = bool(kkt <= SOLVED) and not answer.failure
    for name in ready:
        rows[name]["solve_ms"] = float(np.median(times[name][1:]))
    return list(rows.values())


def _row(path: Path, task: Task, name: str) -> Row:
    return {
        "qp": path.stem, "solver": name, "stages": len(task.staged.knots),
        "variables": task.general.q.size, "rows": task.general.low.size, "solve_ms": None,
        "kkt_error": None, "cost": None, "solved": False, "failure": "",
    }  # fmt: skip


def report_qps(results: dict[str, Any], console: Console, folder: Path | None = None) -> None:
    """A line a family of files (a name without its number) and solver, and all that were not
    solved; the performance profile goes into `folder`.
    """
    table = Table(title=f"QPs solved to a scaled KKT error of {SOLVED:g}", box=None)
    for name in ("family", "solver", "solved", "median ms", "slowest ms", "worst error"):
        table.add_column(name, justify="left" if name in ("family", "solver") else "right")
    families: dict[tuple[str, str], list[Row]] = {}
    for row in results["rows"]:
        family = row["qp"].rstrip("0123456789").rstrip("_-") or row["qp"]
        families.setdefault((family, row["solver"]), []).append(row)
    for (family, solver), rows in families.items():
        solved = [row for row in rows if row["solved"]]
        times = [row["solve_ms"] for row in solved]
        errors = [row["kkt_error"] for row in rows if row["kkt_error"] is not None]
        table.add_row(
            family,
            solver,
            f"{len(solved)}/{len(rows)}",
            *((f"{np.median(times):.3g}", f"{max(times):.3g}") if times else ("", "")),
            f"{max(errors):.1e}" if errors else "",
        )
    console.print(table)
    _print_unsolved(results["rows"], console)
    if folder is not None:
        console.print(f"picture: {_draw(results['rows'], folder)}", markup=False, highlight=False)
    for name, why in results["skipped"].items():
        console.print(f"left out: {name}: {why}", markup=False, highlight=False)


def _print_unsolved(rows: list[Row], console: Console) -> None:
    for solver in dict.fromkeys(row["solver"] for row in rows):
        unsolved = [row["qp"] for row in rows if row["solver"] == solver and not row["solved"]]
        if unsolved:
            text = f"not solved by {solver}: {', '.join(unsolved)}"
            console.print(text, markup=False, highlight=False, soft_wrap=True)


def _draw(rows: list[Row], folder: Path) -> Path:
    runs = [
        {
            "problem": row["qp"], "start": "", "solver": row["solver"],
            "milliseconds": row["solve_ms"],
            "verdict": Verdict.OPTIMAL if row["solved"] else Verdict.FAILED,
        }
        for row in rows
    ]  # fmt: skip
    return draw_profile(runs, "milliseconds", folder / "profile-qps.png")
