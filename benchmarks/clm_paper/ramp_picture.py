"""Figures 6 and 7 of the paper: the ramp, and what legs must reach at its upper edge."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from palanquin.benchmarks.clm_paper.figures_of_runs import standing_legs
from palanquin.benchmarks.clm_paper.seeds import Runs
from palanquin.benchmarks.clm_paper.style import (
    LIMIT,
    OURS,
    PAPERS,
    body_colour,
    legend_above,
    new_figure,
    tidy,
)
from palanquin.problems.terrain_kinds import RampKind
from palanquin.sim.show.legs import leg_limits


def draw_ramp(ours: Runs, path: Path) -> None:
    """Figure 6: height, place and slope of the ramp (17), with the way of all bodies over it."""
    rollout = ours.first
    figure = new_figure(3.6)
    axes = figure.subplots()
    bodies = rollout.bodies
    x = np.linspace(bodies[:, 1:, 0].min() - 0.5, bodies[..., 0].max() + 0.3, 400)
    ground = ours.scenario.ground.height(x, np.zeros_like(x))
    axes.fill_between(x, ground, ground.min() - 0.1, color="0.85", zorder=0)
    axes.plot(x, ground, color="black", linewidth=1)
    for body, name in enumerate(("payload", *(robot.name for robot in rollout.team.robots))):
        style = "--" if body > 1 else "-"  # robots side by side: the last one on top of the others
        axes.plot(
            bodies[:, body, 0], bodies[:, body, 2], style, color=body_colour(body), label=name
        )
    axes.margins(x=0)
    if isinstance(ours.scenario.terrain, RampKind):
        _mark_geometry(axes, ours.scenario.terrain)
    axes.set_aspect("equal")
    axes.set_xlabel("x, m")
    axes.set_ylabel("z, m")
    tidy(axes)
    legend_above(axes)
    figure.savefig(path, dpi=150)


def _mark_geometry(axes: Axes, ramp: RampKind) -> None:
    """H, kappa and x_g where they can be seen."""
    height, kappa, x, run = ramp.H, ramp.kappa, ramp.xg, 0.5
    axes.plot([x - run, x + run], height / 2 + kappa * np.array([-run, run]), color=LIMIT)
    slope = f"$\\kappa$ = {kappa:g} ({np.degrees(np.arctan(abs(kappa))):.1f}°)"
    axes.annotate(
        f"{slope}, $x_g$ = {x:g} m", (x, height / 2), xytext=(18, -22),
        textcoords="offset points", color=LIMIT,
    )  # fmt: skip
    at = axes.get_xlim()[1] - 0.35 if kappa > 0 else axes.get_xlim()[0] + 0.35
    axes.annotate("", (at, height), (at, 0), arrowprops={"arrowstyle": "<->", "color": "black"})
    axes.text(at - 0.08, height / 2, f"H = {height:g} m", ha="right", va="center")


def draw_reach(
    climb: Runs, descent: Runs, papers: Mapping[str, tuple[Runs, Runs]], path: Path
) -> None:
    """Figure 7: the longest standing leg over the payload's place, climbing and descending.

    Solid, what the robots went through; dotted, what their references would ask for: from the hips
    of the reference pose to the same feet. `papers` names runs with the paper's references, up and
    down.
    """
    figure = new_figure(6.8)
    axes = figure.subplots(2, 1, sharex=True, sharey=True)
    named = {"own ground (ours)": (climb, descent), **papers}
    for axis, way, title in zip(axes, (0, 1), ("up", "down"), strict=True):
        for colour, (name, runs) in zip((OURS, *PAPERS), named.items(), strict=False):
            _draw_legs(axis, runs[way], colour, name)
        limit = 100 * leg_limits(climb.scenario.team).min()
        axis.axhline(limit, color=LIMIT, linewidth=1.2, label="limit $l_f$")
        axis.set_ylabel(f"longest standing\nleg, cm\n({title})")
    legend_above(axes[0], columns=4)
    axes[1].set_xlabel("payload's x, m (direction of travel to the right)")
    tidy(axes)
    figure.savefig(path, dpi=150)


def _draw_legs(axes: Axes, runs: Runs, colour: str, name: str) -> None:
    rollout, scenario = runs.first, runs.scenario
    states = rollout.bodies
    wanted = rollout.reference.reshape(states.shape)
    for bodies, style, what in ((states, "-", "walked"), (wanted, ":", "reference")):
        longest = 100 * standing_legs(scenario, rollout, bodies).max(axis=(1, 2))
        axes.plot(
            states[:, 0, 0], longest, style, color=colour, linewidth=1.2, label=f"{name}: {what}"
        )
