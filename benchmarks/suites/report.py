"""What came out of a suite, as tables and performance profiles."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table

from palanquin.benchmarks.suites.verdict import MARKS, Verdict
from palanquin.benchmarks.tables import print_machine

Row = dict[str, Any]
_FEW = 5  # starts that tables show one by one
_GOOD = (Verdict.OPTIMAL, Verdict.DEARER)
LEGEND = ", ".join(f"{mark} {verdict}" for verdict, mark in MARKS.items())


def report_suite(results: dict[str, Any], folder: Path, console: Console) -> list[Path]:
    """Prints the tables, writes the profiles; returns the pictures' paths."""
    rows = results["rows"]
    console.print(_verdict_table(rows))
    console.print(LEGEND, markup=False, highlight=False)
    console.print(_count_table(rows))
    _print_wrong(rows, console)
    print_machine(console, results["machine"], results["revision"])
    return [
        draw_profile(rows, figure, folder / f"profile-{figure}.png")
        for figure in ("iterations", "milliseconds")
    ]


def performance_profile(rows: list[Row], figure: str) -> dict[str, np.ndarray]:
    """By solver: the sorted ratios of its `figure` to the best solver's, one a run it solved.

    Solved is converged to a certified optimum, the same one or another (Dolan and More, 2002).
    """
    solved = [row for row in rows if row["verdict"] in _GOOD]
    best: dict[tuple[str, str], float] = {}
    for row in solved:
        run = (row["problem"], row["start"])
        best[run] = min(best.get(run, np.inf), _positive(row[figure]))
    ratios: dict[str, list[float]] = {solver: [] for solver in _solvers(rows)}
    for row in solved:
        own = _positive(row[figure]) / best[row["problem"], row["start"]]
        ratios[row["solver"]].append(own)
    return {solver: np.sort(values) for solver, values in ratios.items()}


def _positive(value: float) -> float:
    return max(float(value), 1e-3)


def _solvers(rows: list[Row]) -> list[str]:
    return list(dict.fromkeys(row["solver"] for row in rows))


def _verdict_table(rows: list[Row]) -> Table:
    """A mark for each start, in their order, and the most iterations of those that converged."""
    solvers = _solvers(rows)
    starts = list(dict.fromkeys(row["start"] for row in rows))
    names = ", ".join(starts) if len(starts) <= _FEW else f"{len(starts)}, counted"
    table = Table("problem", box=None, title=f"by solver; starts: {names}")
    for number in range(1, len(solvers) + 1):
        table.add_column(str(number), no_wrap=True)
    for problem in dict.fromkeys(row["problem"] for row in rows):
        cells = []
        for solver in solvers:
            mine = [r for r in rows if r["problem"] == problem and r["solver"] == solver]
            counts = [r["iterations"] for r in mine if r["verdict"] in _GOOD]
            marks = _marks([Verdict(r["verdict"]) for r in mine])
            cells.append(f"{marks} {max(counts)}" if counts else marks)
        table.add_row(problem, *cells)
    return table


def _marks(verdicts: list[Verdict]) -> str:
    """One mark after the other where there are few, else how many there are of each."""
    if len(verdicts) <= _FEW:
        return "".join(MARKS[v] for v in verdicts)
    return " ".join(f"{n}{MARKS[v]}" for v, n in Counter(verdicts).most_common())


def _count_table(rows: list[Row]) -> Table:
    table = Table("", "solver", *MARKS.values(), "runs", box=None)
    for number, solver in enumerate(_solvers(rows), start=1):
        mine = Counter(r["verdict"] for r in rows if r["solver"] == solver)
        counts = (str(mine[v]) for v in MARKS)
        table.add_row(str(number), solver, *counts, str(sum(mine.values())))
    return table


def _print_wrong(rows: list[Row], console: Console) -> None:
    wrong = (Verdict.WRONG_CONVERGED, Verdict.WRONG_INFEASIBLE)
    for row in rows:
        if row["verdict"] in wrong:
            errors = ", ".join(
                f"{name} {row[name]:.1e}"
                for name in ("stationarity", "equality", "inequality")
                if name in row
            )
            console.print(
                f"{row['verdict']}: {row['problem']} from {row['start']} by {row['solver']} "
                f"({errors}): {row['message']}",
                markup=False,
                highlight=False,
                soft_wrap=True,
            )


def draw_profile(rows: list[Row], figure: str, path: Path) -> Path:
    """The picture of a `performance_profile`; returns its path."""
    runs = len({(row["problem"], row["start"]) for row in rows})
    picture = Figure(figsize=(7.5, 5), layout="constrained")
    axes = picture.subplots()
    for solver, ratios in performance_profile(rows, figure).items():
        if len(ratios):
            share = np.arange(1, len(ratios) + 1) / runs
            axes.step(ratios, share, where="post", label=f"{solver} ({len(ratios)} of {runs})")
    axes.set_xscale("log")
    axes.set_ylim(0, 1.02)
    axes.set_xlabel(f"{figure} relative to the best solver's on the same run")
    axes.set_ylabel("share of runs solved")
    axes.grid(alpha=0.3, which="both")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize="small", loc="lower right")
    picture.savefig(path, dpi=130)
    return path
