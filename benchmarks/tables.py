"""Results as tables on the terminal, and the figures derived from them."""

from __future__ import annotations

from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from palanquin.benchmarks.variant import PAPER_SOLVER, Solver
from palanquin.plan import SQP_PHASES

Row = dict[str, Any]

LIMITATIONS = (
    "One machine and one task: a trot at 0.4 m/s with disturbed velocities. Other contacts and "
    "terrains cost differently.",
    "Times are the solver's own: transcribe, linearise, update, solve, globalise. References, warm "
    "start and arrays, made in Python, come on top (column Python).",
    "Column replay is the median of the same steps taken again back to back, as a loop without "
    "Python takes them: the processor's caches are warm. x: times faster than osqp paper, 1 QP.",
    "Column feedb. is what follows the measurement when a step is taken in two phases, the rest "
    "before it.",
    "OSQP stops at its tolerance (1e-3, cold 1e-5), the others solve QPs exactly. Column cost + is "
    "the closed loop's relative excess of cost over solving every period to convergence.",
    "One QP a step is the paper's method; compare it with its own kind, or see what it costs.",
    "Over ditches a foot's choice of side decides the cost, and may differ between two loops.",
    "Other load on the machine raises p95 and more: see the load average.",
)


def solver_of(row: Row) -> Solver:
    """Who solved the QPs of a row."""
    return Solver(row["qp"], row["form"], row["max_qps"])


def time_table(title: str, rows: list[Row]) -> Table:
    """Quantiles of the step in ms, and the median of steps taken again back to back.

    "x" after either: how many times faster than `PAPER_SOLVER` in the same figure.
    """
    table = _table(title, ("p50", "p95", "p99", "max", "x", "replay", "x"))
    for row in rows:
        if row["solve_ms"] is None:
            table.add_row(*names_of(row), "failed:", row["error"])
            continue
        table.add_row(
            *names_of(row),
            *(f"{row['solve_ms'][q]:.3g}" for q in ("p50", "p95", "p99", "max")),
            _number(speedup(row, rows, PAPER_SOLVER), "{:.1f}"),
            _number(median(row, "replay_ms"), "{:.3g}"),
            _number(speedup(row, rows, PAPER_SOLVER, "replay_ms"), "{:.1f}"),
        )
    return table


def phase_table(title: str, rows: list[Row]) -> Table:
    """Where the solver's time goes, and what of it comes after the measurement."""
    table = _table(title, ("transcr.", "lin.", "update", "solve", "glob.", "feedb."))
    for row in rows:
        if row["solve_ms"] is not None:
            table.add_row(
                *names_of(row),
                *(f"{row['phases_ms'][phase]:.3f}" for phase in SQP_PHASES),
                _number(row["feedback_ms"], "{:.3f}"),
            )
    return table


def work_table(title: str, rows: list[Row]) -> Table:
    """Rate, what Python adds, the work in a step, and how good the plans are."""
    names = ("Hz", "Python", "QPs", "MFLOP", "GFLOPS", "cost +", "failed")
    table = _table(title, names)
    for row in rows:
        if row["solve_ms"] is not None:
            table.add_row(
                *names_of(row),
                f"{row['rate_hz']:.0f}",
                f"{row['python_ms']:.1f}",
                f"{row['qps']:.0f}",
                _number(row["mflop"], "{:.2f}"),
                _number(row["gflops"], "{:.1f}"),
                _number(row["cost_excess"], "{:.1e}"),
                f"{row['failed_steps']}/{row['steps']}" if row["error"] else "",
            )
    return table


def median(row: Row, figure: str = "solve_ms") -> float | None:
    """Median of a row's `figure`, ms: "solve_ms" in the loop, "replay_ms" back to back."""
    return float(row[figure]["p50"]) if row.get(figure) else None


def speedup(row: Row, rows: list[Row], other: Solver, figure: str = "solve_ms") -> float | None:
    """How many times faster than `other` on the same task and start, medians; None without it."""
    same = ("robots", "horizon", "ditches", "start", "threads")
    own = median(row, figure)
    for peer in rows:
        if solver_of(peer) == other and all(peer[k] == row[k] for k in same):
            theirs = median(peer, figure)
            return theirs / own if own and theirs else None
    return None


def slope(rows: list[Row], over: str, figure: str = "solve_ms") -> float | None:
    """Least-squares slope of log(median) against log(row[over]); None for fewer than two values."""
    points = [(row[over], time) for row in rows if (time := median(row, figure))]
    if len({x for x, _ in points}) < 2:
        return None
    x, y = np.log(np.array(points, dtype=float)).T
    return float(np.polyfit(x, y, 1)[0])


def print_machine(console: Console, machine: dict[str, Any], revision: str) -> None:
    """What the figures were measured on."""
    load = ", ".join(f"{value:.1f}" for value in machine["load_average"])
    console.print(
        f"{machine['cpu']}, {machine['threads_used']} of {machine['cores_allowed']} cores, "
        f"load {load} at the start; engine by gcc {machine['engine_compiler']}, "
        f"kernels {machine['kernels']}; lowered by {machine['lowering_compiler']}; "
        f"revision {revision}",
        highlight=False,
        markup=False,
    )


def print_limitations(console: Console, limitations: tuple[str, ...] = LIMITATIONS) -> None:
    """What the figures do not say."""
    console.print("Limitations:", *(f"- {line}" for line in limitations), sep="\n", markup=False)


def _table(title: str, figures: tuple[str, ...]) -> Table:
    table = Table(title=title, box=None, padding=(0, 1, 0, 0))
    for name in ("R x N", "solver"):
        table.add_column(name, no_wrap=True)
    for name in figures:
        table.add_column(name, justify="right", no_wrap=True)
    return table


def names_of(row: Row) -> tuple[str, str]:
    """Robots by intervals, with the number of ditches if there are any, and who solved."""
    ditches = f", {row['ditches']} d." if row["ditches"] else ""
    return f"{row['robots']} x {row['horizon']}{ditches}", solver_of(row).label


def _number(value: float | None, form: str) -> str:
    return "" if value is None else form.format(value)
