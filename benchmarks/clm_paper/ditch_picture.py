"""Ditches (section IV-B): every foothold of a run, and the nearest edge of every run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from palanquin.benchmarks.clm_paper.seeds import Runs
from palanquin.benchmarks.clm_paper.style import LIMIT, body_colour, legend_above, new_figure, tidy
from palanquin.sim.runs.record import Record

ALLOWED = 1e-3
"""How deep a foothold may be in a ditch, m."""


def draw_ditches(runs: Runs, path: Path) -> None:
    """The first seed's footholds from above, front and hind; below, over all seeds, how far the
    foothold nearest to a ditch stays outside of it, or is inside (negative).
    """
    figure = new_figure(5.5)
    above, below = figure.subplots(2, 1, height_ratios=(3, 2))
    _draw_from_above(above, runs)
    clearance = -1e3 * np.array([row["deepest_foothold_m"] for row in runs.rows])
    seeds = [row["seed"] for row in runs.rows]
    below.bar(seeds, clearance, color="0.6", width=0.6, zorder=2)
    below.axhline(-1e3 * ALLOWED, color=LIMIT, linewidth=1)
    below.text(seeds[0], -1e3 * ALLOWED, "allowed", color=LIMIT, va="bottom")
    below.axhline(0, color="black", linewidth=0.8)
    below.set_ylim(-1.4e3 * ALLOWED, max(1.2, 1.2 * clearance.max()))
    below.set_xlabel("seed of ditches and start")
    below.set_xticks(seeds)
    below.set_ylabel("foothold nearest to\na ditch, mm outside")
    tidy(below)
    figure.savefig(path, dpi=150)


def _draw_from_above(axes: Axes, runs: Runs) -> None:
    rollout, scenario = runs.first, runs.scenario
    for j, (a, _, c, width) in enumerate(scenario.ditches.draw(scenario.seed)):
        label = "ditch" if j == 0 else None
        axes.axvspan(-c / a - width / 2, -c / a + width / 2, color="0.82", zorder=0, label=label)
    for i, robot in enumerate(rollout.team.robots):
        colour = body_colour(i + 1)
        for pair, feet, fill in (("front", slice(0, 2), colour), ("hind", slice(2, 4), "none")):
            x, y, _ = footholds(rollout, i, feet).T
            axes.plot(
                x, y, "o", color=colour, markerfacecolor=fill, markersize=4.5,
                label=f"{robot.name}, {pair}",
            )  # fmt: skip
    path = rollout.bodies[:, 0]
    axes.plot(path[:, 0], path[:, 1], color=body_colour(0), label="payload")
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    axes.margins(x=0.01)
    axes.spines[["top", "right"]].set_visible(False)
    legend_above(axes)


def footholds(rollout: Record, robot: int, feet: slice) -> np.ndarray:
    """Where feet of a robot came to stand, [n, 3], m."""
    standing = rollout.contact[:, robot, feet] > 0.5
    landed = standing.copy()
    landed[1:] &= ~standing[:-1]
    return rollout.feet[:, robot, feet][landed]
