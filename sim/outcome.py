"""The figures of a run: how well it went, as numbers."""

from __future__ import annotations

from typing import Any

import numpy as np

from palanquin._core import Status, is_usable
from palanquin.events import count_events
from palanquin.plan import SQP_PHASES
from palanquin.problems import quaternions
from palanquin.problems.clm.build import FORCE_FAMILIES
from palanquin.problems.modules.limits import FORCE_UNIT
from palanquin.sim.closed_loop import number_of_ticks
from palanquin.sim.rollout import Rollout
from palanquin.sim.tracking import tracking_error

SETTLING_TIME = 1.0
"""Payload errors count from here on, s; from the middle of a run of less than twice that."""

FALL_ANGLE = np.radians(30.0)
"""A body that leans further than this from its reference has fallen, rad."""

FALL_HEIGHT = 0.5
"""So has a robot that is lower over the ground than this share of its reference's height."""


def outcome(rollout: Rollout, duration: float, period: float) -> dict[str, Any]:
    """What a rollout amounts to that was to take `duration`, planned every `period` (s); for JSON.

    "completed" means to the end without a fall; "violation" holds the largest one of each family
    in its unit (m; forces in 100 N); "fallbacks" counts the ticks whose solve gave no usable plan,
    so that the last one was followed on; "events" counts what the planner did other than full
    steps, by kind; "solve_ms" is wall time from measurement to plan, "solver_ms" the solver's part.
    """
    solver = np.sum([rollout.phases[name] for name in SQP_PHASES], axis=0)
    usable = {status.name.lower() for status in Status if is_usable(status)}
    has_fallen = fell(rollout)
    return {
        "completed": len(rollout.time) == number_of_ticks(duration, period) and not has_fallen,
        "fell": has_fallen,
        "duration_s": float(len(rollout.time) * period),
        "distance_m": distance(rollout),
        "payload_position_error_m": payload_error(rollout),
        "violation": {
            family: float(values.max() / (FORCE_UNIT if family in FORCE_FAMILIES else 1.0))
            for family, values in rollout.violation.items()
        },
        "equality_violation": float(rollout.equality_violation.max()),
        "solve_ms": percentiles(rollout.solve_ms),
        "solver_ms": percentiles(solver),
        "phases_ms": {name: float(np.median(v)) for name, v in rollout.phases.items()},
        "deadline_misses": int((rollout.solve_ms > 1e3 * period).sum()),
        "fallbacks": int(sum(status not in usable for status in rollout.status)),
        "events": count_events(rollout.events),
    }


def payload_error(rollout: Rollout) -> dict[str, float]:
    """RMS and maximum distance of the payload from its reference once settled, m."""
    settled = rollout.time >= min(SETTLING_TIME, rollout.time[-1] / 2)
    error = tracking_error(rollout).position[settled, 0]
    return {"rms": float(np.sqrt(np.mean(error**2))), "max": float(error.max())}


def distance(rollout: Rollout) -> float:
    """Length of the payload's path over the ground, m."""
    return float(np.linalg.norm(np.diff(rollout.x[:, :2], axis=0), axis=1).sum())


def fell(rollout: Rollout) -> bool:
    """Whether a body leaned too far from its reference, or a robot sank too low."""
    shape = (len(rollout.time), rollout.robots + 1, 13)
    x, reference = rollout.x.reshape(shape), rollout.reference.reshape(shape)
    up = np.array([0.0, 0.0, 1.0])
    axes = [quaternions.rotate(states[..., 3:7], up) for states in (x, reference)]
    cosine = (axes[0] * axes[1]).sum(axis=-1)
    ground = rollout.team.ground
    height, wanted = (
        states[:, 1:, 2] - ground.height(states[:, 1:, 0], states[:, 1:, 1])
        for states in (x, reference)
    )
    return bool((cosine < np.cos(FALL_ANGLE)).any() or (height < FALL_HEIGHT * wanted).any())


def percentiles(values: np.ndarray) -> dict[str, float]:
    """p50, p95, p99 and max of `values` [T]."""
    cuts = {"p50": 50, "p95": 95, "p99": 99, "max": 100}
    return {name: float(np.percentile(values, cut)) for name, cut in cuts.items()}
