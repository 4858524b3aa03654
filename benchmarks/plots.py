"""Rates as pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palanquin.benchmarks.tables import solver_of
from palanquin.benchmarks.variant import SOLVERS

Row = dict[str, Any]

# De Vincenti and Coros, section IV-A: two robots, horizon (s) and rate (Hz) on an i7-11800H.
PAPER_RATES = ((0.5, 30.0), (0.66, 25.0), (1.03, 18.0))

_COLOURS = {"structured": "tab:blue", "ldl": "tab:green", "osqp": "tab:red"}


def plot_rate_over_horizon(rows: list[Row], title: str, path: Path) -> None:
    """Median rate with a band down to p99 against the horizon, beside the paper's own rates."""
    figure, axes = _axes(title)
    _plot_rates(axes, rows, "horizon_s")
    axes.axhline(30, color="black", linewidth=0.8, linestyle=":")
    axes.text(0.99, 31, "30 Hz", ha="right", va="bottom", transform=axes.get_yaxis_transform())
    if any(row["robots"] == 2 for row in rows):
        axes.plot(*zip(*PAPER_RATES, strict=True), "k*", markersize=9,
                  label="De Vincenti and Coros, their machine")  # fmt: skip
    axes.set_xlabel("horizon (s)")
    _finish(figure, axes, path)


def plot_rate_over_robots(rows: list[Row], title: str, path: Path) -> None:
    """Median rate with a band down to p99 against the number of robots."""
    figure, axes = _axes(title)
    _plot_rates(axes, rows, "robots")
    axes.set_xticks(sorted({row["robots"] for row in rows}))
    axes.set_xlabel("robots")
    _finish(figure, axes, path)


def _axes(title: str) -> tuple[Figure, Axes]:
    figure = Figure(figsize=(7.5, 5), layout="constrained")
    axes = figure.subplots()
    axes.set_title(title)
    return figure, axes


def _plot_rates(axes: Axes, rows: list[Row], over: str) -> None:
    for solver in SOLVERS:
        mine = [row for row in rows if solver_of(row) == solver and row["solve_ms"]]
        if not mine:
            continue
        colour = _COLOURS[solver.qp]
        line = ":" if solver.max_qps == 1 else "--" if solver.form == "paper" else "-"
        mine.sort(key=lambda row: row[over])
        x = [row[over] for row in mine]
        median = [1e3 / row["solve_ms"]["p50"] for row in mine]
        slow = [1e3 / row["solve_ms"]["p99"] for row in mine]
        axes.plot(x, median, line, color=colour, marker="o", markersize=3.5, label=solver.label)
        axes.fill_between(x, slow, median, color=colour, alpha=0.12, linewidth=0)


def _finish(figure: Figure, axes: Axes, path: Path) -> None:
    axes.set_yscale("log")
    axes.set_ylabel("rate of the solver alone (Hz), median, band down to p99")
    axes.grid(alpha=0.3, which="both")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize="small")
    figure.savefig(path, dpi=130)
