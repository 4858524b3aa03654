"""Plots of a run over time: of any run tracking, times and violations, of robots on bars also the
curves of Kim et al.'s figures.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palanquin.problems import quaternions
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.tracking import estimation_error, tracking_error
from palanquin.sim.scenes.palette import robot_colour

_STYLE: dict[str, Any] = {"linewidth": 1.1}

_FLOOR = 1e-8
"""Violations below this are drawn at it, so that a logarithmic axis can show zero."""

Plot = Callable[[Axes, Record], None]


def draw_plots(record: Record, path: Path) -> None:
    """Write one picture (format by the suffix of `path`) with what the record has to show."""
    plots = plots_of(record)
    figure = Figure(figsize=(8.5, 2.2 * len(plots) + 2), layout="constrained")
    grid = figure.subplots(len(plots), 1, sharex=True)
    for axes, plot in zip(grid, plots, strict=True):
        plot(axes, record)
        finish(axes)
    grid[-1].set_xlabel("time (s)")
    figure.savefig(path, dpi=130)


def plots_of(record: Record) -> list[Plot]:
    """Of a payload in hands tracking, what was estimated and observed, times and violations; of
    robots on bars velocities, a force's curve, virtual constraints in physics, multipliers, times.
    """
    if "estimates" not in record.more:
        observers = [plot_observed_forces, plot_apparent_mass]
        observed = observers if "observed_wrench" in record.more else []
        estimates: list[Plot] = [plot_estimation, plot_known_force]
        estimated = estimates if "true_bodies" in record.more else []
        return [plot_tracking, *estimated, *observed, plot_solve_times, plot_violation]
    plots: list[Plot] = [partial(plot_velocity, axis=axis) for axis in (0, 1)]
    plots.append(plot_vertical_force)
    if "output_error" in record.more:
        plots.append(plot_virtual_constraints)
    return [*plots, plot_multipliers, plot_solve_times]


def finish(axes: Axes) -> None:
    """A light grid, two spines, the legend in a row above, where it hides nothing."""
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=8, frameon=False, fontsize="small")


def plot_tracking(axes: Axes, record: Record) -> None:
    """Position errors of payload and robots, cm."""
    _plot_of_bodies(axes, record, 100 * tracking_error(record).position)
    axes.set_ylabel("position error (cm)")


def plot_estimation(axes: Axes, record: Record) -> None:
    """How far payload and robots are from where they are taken to be, mm."""
    _plot_of_bodies(axes, record, 1e3 * estimation_error(record).position)
    axes.set_ylabel("estimate's error (mm)")


def _plot_of_bodies(axes: Axes, record: Record, values: np.ndarray) -> None:
    """Values [T, B] from 0 on."""
    axes.plot(record.time, values[:, 0], color="black", linewidth=1.8, label="payload")
    for i, name in enumerate(record.team.names):
        axes.plot(record.time, values[:, i + 1], color=robot_colour(i), label=name)
    axes.set_ylim(bottom=0)


def plot_known_force(axes: Axes, record: Record, robot: int = 0, foot: int = 0) -> None:
    """The vertical force on one foot, and as its robot knows it, N."""
    axes.plot(
        record.time, record.more["foot_force"][:, robot, foot, 2], "k", label="true", **_STYLE
    )
    known = record.more["known_force"][:, robot, foot, 2]
    axes.plot(record.time, known, color=robot_colour(robot), label="known", **_STYLE)
    axes.set_ylabel("force on a foot (N)")


def plot_observed_forces(axes: Axes, record: Record) -> None:
    """Unknown forces on robots as the planner observes them, N."""
    force = np.linalg.norm(record.more["observed_wrench"][:, 1:, :3], axis=-1)
    for i, name in enumerate(record.team.names):
        axes.plot(record.time, force[:, i], color=robot_colour(i), label=name)
    axes.set_ylabel("observed force (N)")


def plot_apparent_mass(axes: Axes, record: Record) -> None:
    """What the payload seems to weigh, kg."""
    mass = record.more["apparent_payload_mass"]
    axes.plot(record.time, mass, color="black", label="payload")
    axes.set_ylabel("apparent mass (kg)")


def plot_solve_times(axes: Axes, record: Record) -> None:
    """Time of a plan and of its phases with the period, ms."""
    axes.semilogy(record.time, record.solve_ms, "k", label="total", linewidth=0.9)
    for name, values in record.phases.items():
        axes.semilogy(record.time, values, linewidth=0.9, label=name)
    period = 1e3 * record.period
    axes.axhline(period, color="tab:red", linestyle="--", linewidth=1, label="period")
    axes.set_ylabel("time per plan (ms)")


def plot_violation(axes: Axes, record: Record) -> None:
    """The worst one of each family."""
    families = {**record.violation, "equalities": record.equality_violation}
    for name, values in families.items():
        axes.semilogy(record.time, np.maximum(values, _FLOOR), linewidth=1.2, label=name)
    axes.set_ylabel(f"worst violation (at least {_FLOOR:g})")


def plot_velocity(axes: Axes, record: Record, axis: int) -> None:
    """Desired, planned and actual velocities of the centres of mass (Figures 10, 12, 14, 17)."""
    component = 7 + axis
    axes.plot(record.time, record.references[:, 0, component], "k--", label="desired", **_STYLE)
    for i, name in enumerate(record.team.names):
        colour = robot_colour(i)
        axes.plot(record.time, record.bodies[:, i, component], color=colour, alpha=0.35, **_STYLE)
        planned = record.planned[:, 1, i, component]
        axes.plot(record.time, planned, color=colour, label=f"{name}, planned", **_STYLE)
    axes.set_ylabel(f"v{'xyz'[axis]} (m/s)")


def plot_vertical_force(axes: Axes, record: Record, foot: int = 0) -> None:
    """The plan's vertical force of one foot of each robot (Figures 13, 15, 18)."""
    for i, name in enumerate(record.team.names):
        force = record.force[:, i, foot, 2]
        label = f"{name}, left front"
        axes.plot(record.time, force, color=robot_colour(i), label=label, **_STYLE)
    axes.set_ylabel("planned force (N)")


def plot_virtual_constraints(axes: Axes, record: Record, robot: int = 0) -> None:
    """Position along x, y (m), roll and pitch (rad) of one robot against the plan (Figure 20)."""
    error = record.more["output_error"][:, robot]
    for index, label in ((0, "x (m)"), (1, "y (m)"), (3, "roll (rad)"), (4, "pitch (rad)")):
        axes.plot(record.time, error[:, index], label=label, **_STYLE)
    axes.set_ylabel("virtual constraints")


def plot_multipliers(axes: Axes, record: Record) -> None:
    """Each robot's estimate of the first bar's multiplier (Figure 22)."""
    estimates = record.more["estimates"]
    for i, name in enumerate(record.team.names):
        if estimates.shape[2] and np.isfinite(estimates[:, i, 0]).any():
            values = estimates[:, i, 0]
            axes.plot(record.time, values, color=robot_colour(i), label=name, **_STYLE)
    axes.set_ylabel("lambda (N/m)")


def plot_phase(axes: Axes, record: Record, axis: int, label: str, robot: int = 0) -> None:
    """Phase portrait of a robot's roll (axis 0) or pitch (1) (Figures 16, 25)."""
    states = record.bodies[:, robot]
    rotation = quaternions.matrix(states[:, 3:7])
    roll = np.arctan2(rotation[:, 2, 1], rotation[:, 2, 2])
    pitch = -np.arcsin(np.clip(rotation[:, 2, 0], -1, 1))
    axes.plot((roll, pitch)[axis], states[:, 10 + axis], label=label, linewidth=0.6)
    axes.set_xlabel(f"{('roll', 'pitch')[axis]} (rad)")
    axes.set_ylabel("rate (rad/s)")
