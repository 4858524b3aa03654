"""`palanquin bench horizon`: how the rate falls with the horizon, for each QP back end."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console

from palanquin.benchmarks.plots import plot_rate_over_horizon
from palanquin.benchmarks.tables import (
    phase_table,
    print_limitations,
    print_machine,
    time_table,
    work_table,
)
from palanquin.benchmarks.variant import Task, Variant, chosen_solvers

HORIZONS = (5, 10, 15, 20, 31)


def horizon_variants(
    robots: int = 2,
    horizons: list[int] | None = None,
    qps: list[str] | None = None,
    threads: int = 1,
) -> list[Variant]:
    """Every back end on every horizon, warm."""
    return [
        Variant(Task(robots, n), solver, threads=threads)
        for n in horizons or HORIZONS
        for solver in chosen_solvers(qps or [])
    ]


def report_horizon(results: dict[str, Any], folder: Path, console: Console) -> list[Path]:
    """Prints the table and draws the plot; returns the pictures."""
    rows = results["rows"]
    console.print(time_table("Real-time iterations in closed loop, ms", rows))
    console.print(phase_table("Medians of the phases, ms", rows))
    console.print(work_table("Work and quality", rows))
    print_machine(console, results["machine"], results["revision"])
    print_limitations(console)
    path = folder / "rate-over-horizon.png"
    robots = ", ".join(str(r) for r in sorted({row["robots"] for row in rows}))
    plot_rate_over_horizon(rows, f"Rate over horizon, {robots} robots in trot", path)
    return [path]
