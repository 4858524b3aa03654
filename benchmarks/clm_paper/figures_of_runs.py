"""Figures of single runs, as plain data."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from palanquin.problems import quaternions
from palanquin.problems.clm.clear_ground import ditch_depths
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.scenarios import Scenario
from palanquin.sim.show.legs import leg_lengths, leg_limits

Row = dict[str, Any]


def figures_of(scenario: Scenario, rollout: Record) -> Row:
    """What every run has: `outcome`, each event by its time, and how far legs were stretched.

    "violation" counts all of every plan, "leg_over_limit_m" the legs on which robots stood.
    """
    late = rollout.solve_ms > 1e3 * rollout.period
    states = rollout.bodies
    over = standing_legs(scenario, rollout, states) - leg_limits(scenario.team)[:, None]
    row = outcome(rollout)
    return {
        **row,
        "seed": scenario.seed,
        "load": os.getloadavg()[0],
        "fallbacks": [
            {"time_s": float(rollout.time[k]), "status": str(rollout.status[k])}
            for k in np.flatnonzero(~rollout.usable)
        ],
        "late": [
            {"time_s": float(rollout.time[k]), "ms": float(rollout.solve_ms[k])}
            for k in np.flatnonzero(late)
        ],
        "leg_over_limit_m": float(over.max()),
    }


def standing_legs(scenario: Scenario, rollout: Record, states: np.ndarray) -> np.ndarray:
    """Lengths [T, R, 4], m, of the legs, from the hips of `states` [T, R+1, 13]; 0 in the air."""
    lengths = leg_lengths(scenario.team, states, rollout.feet)
    return np.where(rollout.contact > 0.5, lengths, 0.0)


def payload_shift(rollout: Record, since: float) -> float:
    """How far the payload gets from where it was at `since` (s), m."""
    position = rollout.bodies[:, 0, :3][rollout.time >= since]
    return float(np.linalg.norm(position - position[0], axis=-1).max())


def steepest_lean(rollout: Record) -> float:
    """Largest roll or pitch of any body, degrees."""
    axes = quaternions.matrix(rollout.bodies[..., 3:7])
    roll = np.arctan2(axes[..., 2, 1], axes[..., 2, 2])
    pitch = np.arcsin(np.clip(-axes[..., 2, 0], -1.0, 1.0))
    return float(np.degrees(np.maximum(np.abs(roll), np.abs(pitch)).max()))


def step_towards_payload(rollout: Record, since: float, robot: int) -> float:
    """How far the mean of a robot's feet gets towards the payload along y after `since` (s), m."""
    later = rollout.time >= since
    feet = rollout.feet[later, robot, :, 1].mean(axis=-1)
    side = np.sign(rollout.bodies[later][0, 0, 1] - feet[0])
    return float((side * (feet - feet[0])).max())


def deepest_foothold(rollout: Record, lines: Sequence[Sequence[float]]) -> float:
    """Depth (11) of the deepest foothold in a ditch (a, b, c, d), m; negative outside."""
    footholds = rollout.feet[rollout.contact > 0.5]
    return float(ditch_depths(footholds[:, :2], np.array(lines)).max())


def is_across(rollout: Record, lines: Sequence[Sequence[float]]) -> bool:
    """Whether all feet stand beyond every ditch (a, b, c, d) at the end, as seen along +x."""
    a, b, c, width = np.array(lines).T
    x, y = rollout.feet[-1, ..., 0, None], rollout.feet[-1, ..., 1, None]
    offset = np.sign(a) * (a * x + b * y + c) / np.hypot(a, b)
    return bool((offset > width / 2).all())
