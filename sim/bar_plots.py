"""Plots of a run of bar carriers, after the figures of Kim et al."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palanquin.problems import quaternions
from palanquin.sim.palette import robot_colour
from palanquin.sim.runs.record import Record

_STYLE: dict[str, Any] = {"linewidth": 1.1}


def draw_plots(record: Record, path: Path) -> None:
    """One picture: velocities, a forces' curve, virtual constraints, multipliers, solve times."""
    figure = Figure(figsize=(9, 13), layout="constrained")
    axes = figure.subplots(6, 1, sharex=True)
    plot_velocity(axes[0], record, 0)
    plot_velocity(axes[1], record, 1)
    plot_vertical_force(axes[2], record)
    plot_virtual_constraints(axes[3], record)
    plot_multipliers(axes[4], record)
    plot_solve_times(axes[5], record)
    axes[-1].set_xlabel("time (s)")
    for one in axes:
        finish(one)
    figure.savefig(path, dpi=120)


def finish(axes: Axes) -> None:
    """A light grid, two spines, the legend above."""
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=8, frameon=False, fontsize="small")


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


def plot_solve_times(axes: Axes, record: Record) -> None:
    """Time of the planner, with the period."""
    axes.semilogy(record.time, record.solve_ms, "k", label="planner", linewidth=0.6)
    axes.axhline(1e3 * record.period, color="tab:red", linestyle="--", label="period")
    axes.set_ylabel("time (ms)")


def plot_phase(axes: Axes, record: Record, axis: int, label: str, robot: int = 0) -> None:
    """Phase portrait of a robot's roll (axis 0) or pitch (1) (Figures 16, 25)."""
    states = record.bodies[:, robot]
    rotation = quaternions.matrix(states[:, 3:7])
    roll = np.arctan2(rotation[:, 2, 1], rotation[:, 2, 2])
    pitch = -np.arcsin(np.clip(rotation[:, 2, 0], -1, 1))
    axes.plot((roll, pitch)[axis], states[:, 10 + axis], label=label, linewidth=0.6)
    axes.set_xlabel(f"{('roll', 'pitch')[axis]} (rad)")
    axes.set_ylabel("rate (rad/s)")
