"""Plots of a rollout: tracking, solve time, violations."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palanquin.sim.palette import robot_colour
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.tracking import tracking_error

_FLOOR = 1e-8
"""Violations below this are drawn at it, so that a logarithmic axis can show zero."""


def draw_figures(rollout: Record, path: Path) -> None:
    """Write one picture (format by the suffix of `path`) with three plots over time.

    Payload and robot position errors (cm), solve times with the period as a line (ms), and the
    worst violation of each family, on logarithmic axes for the latter two.
    """
    figure = Figure(figsize=(8, 8.5), layout="constrained")
    tracking, solve, violation = figure.subplots(3, 1, sharex=True)
    _plot_tracking(tracking, rollout)
    _plot_solve_time(solve, rollout)
    _plot_violation(violation, rollout)
    violation.set_xlabel("time (s)")
    for axes in (tracking, solve, violation):
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=130)


def _plot_tracking(axes: Axes, rollout: Record) -> None:
    error = 100 * tracking_error(rollout).position
    axes.plot(rollout.time, error[:, 0], color="black", linewidth=1.8, label="payload")
    for i, robot in enumerate(rollout.team.robots):
        axes.plot(rollout.time, error[:, i + 1], color=robot_colour(i), label=robot.name)
    axes.set_ylabel("position error (cm)")
    axes.set_ylim(bottom=0)
    _add_legend(axes)


def _plot_solve_time(axes: Axes, rollout: Record) -> None:
    axes.semilogy(rollout.time, rollout.solve_ms, color="black", linewidth=1.2, label="total")
    for name, values in rollout.phases.items():
        axes.semilogy(rollout.time, values, linewidth=0.9, label=name)
    if len(rollout.time) > 1:
        period = 1e3 * float(np.median(np.diff(rollout.time)))
        axes.axhline(period, color="tab:red", linestyle="--", linewidth=1, label="period")
    axes.set_ylabel("time per solve (ms)")
    _add_legend(axes)


def _plot_violation(axes: Axes, rollout: Record) -> None:
    families = {**rollout.violation, "equalities": rollout.equality_violation}
    for name, values in families.items():
        axes.semilogy(rollout.time, np.maximum(values, _FLOOR), linewidth=1.2, label=name)
    axes.set_ylabel(f"worst violation (at least {_FLOOR:g})")
    _add_legend(axes)


def _add_legend(axes: Axes) -> None:
    """In one row above the axes, where it hides nothing."""
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=8, frameon=False, fontsize="small")
