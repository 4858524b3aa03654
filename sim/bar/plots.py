"""Plots of a run of bar carriers, after the figures of Kim et al."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palanquin.problems import quaternions
from palanquin.sim.bar.run import BarRun
from palanquin.sim.palette import robot_colour

_STYLE: dict[str, Any] = {"linewidth": 1.1}


def draw_plots(run: BarRun, path: Path) -> None:
    """One picture: velocities, a forces' curve, virtual constraints, multipliers, solve times."""
    figure = Figure(figsize=(9, 13), layout="constrained")
    axes = figure.subplots(6, 1, sharex=True)
    plot_velocity(axes[0], run, 0)
    plot_velocity(axes[1], run, 1)
    plot_vertical_force(axes[2], run)
    plot_virtual_constraints(axes[3], run)
    plot_multipliers(axes[4], run)
    plot_solve_times(axes[5], run)
    axes[-1].set_xlabel("time (s)")
    for one in axes:
        finish(one)
    figure.savefig(path, dpi=120)


def finish(axes: Axes) -> None:
    """A light grid, two spines, the legend above."""
    axes.grid(alpha=0.3)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=8, frameon=False, fontsize="small")


def plot_velocity(axes: Axes, run: BarRun, axis: int) -> None:
    """Desired, planned and actual velocities of the centres of mass (Figures 10, 12, 14, 17)."""
    ticks, component = run.ticks, 7 + axis
    axes.plot(ticks.time, ticks.desired[:, 0, component], "k--", label="desired", **_STYLE)
    for i, name in enumerate(run.scenario.team.names):
        colour = robot_colour(i)
        axes.plot(ticks.time, ticks.state[:, i, component], color=colour, alpha=0.35, **_STYLE)
        planned = ticks.planned[:, i, component]
        axes.plot(ticks.time, planned, color=colour, label=f"{name}, planned", **_STYLE)
    axes.set_ylabel(f"v{'xyz'[axis]} (m/s)")


def plot_vertical_force(axes: Axes, run: BarRun, foot: int = 0) -> None:
    """The plan's vertical force of one foot of each robot (Figures 13, 15, 18)."""
    ticks = run.ticks
    for i, name in enumerate(run.scenario.team.names):
        force = ticks.planned_force[:, i, foot, 2]
        label = f"{name}, left front"
        axes.plot(ticks.time, force, color=robot_colour(i), label=label, **_STYLE)
    axes.set_ylabel("planned force (N)")


def plot_virtual_constraints(axes: Axes, run: BarRun, robot: int = 0) -> None:
    """Position along x, y (m), roll and pitch (rad) of one robot against the plan (Figure 20)."""
    error = run.ticks.output_error[:, robot]
    for index, label in ((0, "x (m)"), (1, "y (m)"), (3, "roll (rad)"), (4, "pitch (rad)")):
        axes.plot(run.ticks.time, error[:, index], label=label, **_STYLE)
    axes.set_ylabel("virtual constraints")


def plot_multipliers(axes: Axes, run: BarRun) -> None:
    """Each robot's estimate of the first bar's multiplier (Figure 22)."""
    ticks = run.ticks
    for i, name in enumerate(run.scenario.team.names):
        if ticks.multipliers.shape[2] and np.isfinite(ticks.multipliers[:, i, 0]).any():
            values = ticks.multipliers[:, i, 0]
            axes.plot(ticks.time, values, color=robot_colour(i), label=name, **_STYLE)
    axes.set_ylabel("lambda (N/m)")


def plot_solve_times(axes: Axes, run: BarRun) -> None:
    """Time of the planner, with the period."""
    axes.semilogy(run.ticks.time, run.ticks.solve_ms, "k", label="planner", linewidth=0.6)
    axes.axhline(1e3 * run.period, color="tab:red", linestyle="--", label="period")
    axes.set_ylabel("time (ms)")


def plot_phase(axes: Axes, run: BarRun, axis: int, label: str, robot: int = 0) -> None:
    """Phase portrait of a robot's roll (axis 0) or pitch (1) (Figures 16, 25)."""
    states = run.ticks.state[:, robot]
    rotation = quaternions.matrix(states[:, 3:7])
    roll = np.arctan2(rotation[:, 2, 1], rotation[:, 2, 2])
    pitch = -np.arcsin(np.clip(rotation[:, 2, 0], -1, 1))
    axes.plot((roll, pitch)[axis], states[:, 10 + axis], label=label, linewidth=0.6)
    axes.set_xlabel(f"{('roll', 'pitch')[axis]} (rad)")
    axes.set_ylabel("rate (rad/s)")
