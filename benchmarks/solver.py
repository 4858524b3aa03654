"""`palanquin bench solver`: every back end over horizons and teams, cold and warm."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from palanquin.benchmarks.plots import plot_rate_over_horizon, plot_rate_over_robots
from palanquin.benchmarks.tables import (
    median,
    names_of,
    phase_table,
    print_limitations,
    print_machine,
    slope,
    speedup,
    time_table,
    work_table,
)
from palanquin.benchmarks.variant import SOLVERS, Start, Task, Variant, chosen_solvers

Row = dict[str, Any]

ROBOTS = (1, 2, 3, 4)
HORIZONS = (15, 20, 31)
LONG_HORIZONS = (60, 120)
DITCHES = 12
FIGURES = ("solve_ms", "replay_ms")  # in the loop, and the same steps back to back

_STARTS: tuple[Start, ...] = ("warm", "cold")


def solver_variants(
    robots: list[int] | None = None,
    horizons: list[int] | None = None,
    qps: list[str] | None = None,
    threads: int = 1,
    with_long: bool = False,
    with_ditches: bool = True,
) -> list[Variant]:
    """Teams times horizons times ditches times starts times back ends.

    `with_long` adds horizons of 60 and 120 intervals, warm and on flat ground, for the back ends
    whose work should be linear in them: those on the reduced form that factorise.
    """
    solvers = chosen_solvers(qps or [])
    variants = []
    for r in robots or ROBOTS:
        for n in horizons or HORIZONS:
            for ditches in (0, DITCHES) if with_ditches else (0,):
                for start in _STARTS:
                    task = Task(r, n, ditches)
                    variants += [Variant(task, solver, start, threads) for solver in solvers]
        for n in LONG_HORIZONS if with_long else ():
            exact = [s for s in solvers if s.form == "reduced" and s.qp != "osqp"]
            variants += [Variant(Task(r, n), solver, "warm", threads) for solver in exact]
    return variants


def report_solver(results: dict[str, Any], folder: Path, console: Console) -> list[Path]:
    """Prints tables and draws plots; returns the pictures."""
    rows = results["rows"]
    for start, title in (("warm", "Real-time iterations"), ("cold", "From cold to convergence")):
        chosen = [row for row in rows if row["start"] == start]
        if chosen:
            console.print(time_table(f"{title}, ms", chosen))
            console.print(phase_table(f"{title}, medians of the phases, ms", chosen))
            console.print(work_table(f"{title}, work and quality", chosen))
    warm = [row for row in rows if row["start"] == "warm"]
    console.print(_ratio_table(warm))
    if any(row["ditches"] for row in warm):
        console.print(_ditch_table(warm))
    console.print(_slope_table(warm))
    print_machine(console, results["machine"], results["revision"])
    print_limitations(console)
    return _plot(warm, folder)


def _structured(rows: list[Row], **where: Any) -> list[Row]:
    return [
        row
        for row in rows
        if row["qp"] == "structured"
        and row["solve_ms"]
        and all(row[key] == value for key, value in where.items())
    ]


def _ratio_table(rows: list[Row]) -> Table:
    """How many times faster the structured solver is than each other, medians of the same run."""
    others = [solver for solver in SOLVERS if solver.qp != "structured"]
    table = Table(title="Times faster than", box=None, padding=(0, 1, 0, 0))
    for name in ("R x N", "solver"):
        table.add_column(name, no_wrap=True)
    for other in others:
        table.add_column(other.label, justify="right")
    for row in _structured(rows):
        ratios = [speedup(row, rows, other) for other in others]
        table.add_row(*names_of(row), *("" if r is None else f"{r:.1f}" for r in ratios))
    return table


def _ditch_table(rows: list[Row]) -> Table:
    """Time over ditches relative to flat ground, medians of the same run."""
    table = Table(title="Time with ditches : flat", box=None, padding=(0, 1, 0, 0))
    for name in ("R x N", "solver"):
        table.add_column(name, no_wrap=True)
    for name in ("in the loop", "replay"):
        table.add_column(name, justify="right")
    for row in _structured(rows):
        same = {key: row[key] for key in ("robots", "horizon", "max_qps")}
        flat = _structured(rows, **same, ditches=0)
        if row["ditches"] and flat:
            ratios = [_ratio(row, flat[0], figure) for figure in FIGURES]
            table.add_row(*names_of(row), *("" if r is None else f"{r:.2f}" for r in ratios))
    return table


def _ratio(row: Row, other: Row, figure: str) -> float | None:
    own, theirs = median(row, figure), median(other, figure)
    return own / theirs if own and theirs else None


def _slope_table(rows: list[Row]) -> Table:
    """Growth of the structured solver's median: exponent of N for each R, and of R for each N."""
    table = Table(title="Slope of log time, flat ground", box=None)
    for name in ("against", "at", "solver"):
        table.add_column(name)
    for name in ("in the loop", "replay"):
        table.add_column(name, justify="right")
    for over, fixed, letter in (("horizon", "robots", "R"), ("robots", "horizon", "N")):
        for value in sorted({row[fixed] for row in rows}):
            for solver in (s for s in SOLVERS if s.qp == "structured"):
                where = {fixed: value, "ditches": 0, "max_qps": solver.max_qps}
                growth = [slope(_structured(rows, **where), over, figure) for figure in FIGURES]
                if growth[0] is not None:
                    cells = ("" if g is None else f"{g:.2f}" for g in growth)
                    table.add_row(over, f"{letter} = {value}", solver.label, *cells)
    return table


def _plot(rows: list[Row], folder: Path) -> list[Path]:
    flat = [row for row in rows if not row["ditches"]]
    paths = []
    for r in sorted({row["robots"] for row in flat}):
        paths.append(folder / f"rate-over-horizon-{r}-robots.png")
        chosen = [row for row in flat if row["robots"] == r]
        plot_rate_over_horizon(chosen, f"Rate over horizon, R = {r}, flat ground", paths[-1])
    for n in sorted({row["horizon"] for row in flat}):
        chosen = [row for row in flat if row["horizon"] == n]
        if len({row["robots"] for row in chosen}) > 1:
            paths.append(folder / f"rate-over-robots-{n}-intervals.png")
            plot_rate_over_robots(chosen, f"Rate over robots, N = {n}, flat ground", paths[-1])
    return paths
