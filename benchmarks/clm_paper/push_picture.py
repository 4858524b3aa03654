"""Figure 5 of the paper: forces on the payload and motion of all bodies under a push."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from palanquin.benchmarks.clm_paper.seeds import Runs
from palanquin.benchmarks.clm_paper.style import body_colour, new_figure, tidy

MARGIN = (0.7, 2.5)
"""What is shown before the push starts and after it has ended, s."""


def draw_push(one: Runs, other: Runs, path: Path, titles: tuple[str, str]) -> None:
    """Three plots over time as in the paper, for two experiments under their titles.

    Forces of the robots on the payload along x and y; displacement of all bodies along y since the
    push began, and of the middle of each robot's feet (dashed). The push is shaded.
    """
    figure = new_figure(7.5)
    axes = figure.subplots(3, 2, sharex=True, sharey="row")
    for column, (runs, title) in enumerate(zip((one, other), titles, strict=True)):
        axes[0, column].set_title(title)
        _draw_run(axes[:, column], runs)
    axes[0, 0].set_ylabel("force on the\npayload along x, N")
    axes[1, 0].set_ylabel("force on the\npayload along y, N")
    axes[2, 0].set_ylabel("displacement\nalong y, cm")
    for axis in axes[2]:
        axis.set_xlabel("time, s")
    tidy(axes)
    figure.legend(*axes[2, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5,
                  frameon=False)  # fmt: skip
    figure.savefig(path, dpi=150)


def hand_weights(runs: Runs) -> str:
    """What the planner weighs hand wrenches with, as a title."""
    weights = runs.scenario.planner.weights
    return f"$W_f$ = {weights.force[0]:g}, $W_\\tau$ = {weights.torque[0]:g}"


def _draw_run(axes: np.ndarray, runs: Runs) -> None:
    rollout, push = runs.first, runs.scenario.pushes[0]
    time, y = rollout.time, rollout.bodies[..., 1]
    begin, end = push.start, push.start + push.duration
    start = int(np.searchsorted(time, begin))
    for i, robot in enumerate(rollout.team.robots):
        force = -rollout.more["hand_wrench"][:, i]  # of the robot on the payload
        for axis, component in zip(axes[:2], (0, 1), strict=True):
            axis.step(time, force[:, component], where="post", color=body_colour(i + 1))
        feet = rollout.feet[:, i, :, 1].mean(axis=-1)
        axes[2].plot(
            time, 100 * (feet - feet[start]), "--", color=body_colour(i + 1), linewidth=1,
            label=f"{robot.name}'s feet",
        )  # fmt: skip
    for body in range(y.shape[1]):
        label = "payload" if body == 0 else rollout.team.robots[body - 1].name
        label += " (pushed)" if label == push.body else ""
        moved = 100 * (y[:, body] - y[start, body])
        axes[2].plot(time, moved, color=body_colour(body), label=label)
    for axis in axes:
        _shade(axis, begin, end)


def _shade(axis: Axes, begin: float, end: float) -> None:
    axis.axvspan(begin, end, color="0.9", zorder=0)
    axis.axhline(0, color="0.6", linewidth=0.6, zorder=0)
    axis.set_xlim(begin - MARGIN[0], end + MARGIN[1])
