"""The figures of a run: how well it went, as numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from palanquin.events import count_events
from palanquin.plan import SQP_PHASES
from palanquin.problems import quaternions
from palanquin.problems.modules.families import unit_of
from palanquin.sim.runs.bar_outcome import bar_figures
from palanquin.sim.runs.physics_outcome import physics_figures
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.teams import BarCarriers
from palanquin.sim.runs.tracking import tracking_error

SETTLING_TIME = 1.0
"""Payload errors count from here on, s; from the middle of a run of less than twice that."""

FALL_ANGLE = np.radians(30.0)
"""A body that leans further than this from its reference has fallen, rad."""

FALL_HEIGHT = 0.5
"""So has a robot that is lower over the ground than this share of its reference's height."""


def outcome(record: Record) -> dict[str, Any]:
    """What a run amounts to, for JSON: the same figures for every plant, then those of what was
    carried, see `payload_figures` and `bar_figures`.

    "completed" means to the end without a fall; "fall" says when and why; "fallbacks" counts the
    ticks whose solve gave no usable plan, so that the last one was followed on; "events" counts
    what the planner did other than full steps, by kind; "solve_ms" is wall time from measurement to
    plan.
    """
    on_bars = isinstance(record.team, BarCarriers)
    tells_falls = on_bars or "torque_share" in record.more  # physics sees who touches the ground
    has_fallen = bool(record.fall) if tells_falls else fell(record)
    cause = record.fall or "a body fell"
    return {
        "completed": not (has_fallen or record.fall),
        "fell": has_fallen,
        "fall": {"time_s": record.duration, "cause": cause} if has_fallen else None,
        "duration_s": record.duration,
        **(bar_figures(record) if on_bars else payload_figures(record)),
        "solve_ms": percentiles(record.solve_ms),
        "deadline_misses": int((record.solve_ms > 1e3 * record.period).sum()),
        "fallbacks": int((~record.usable).sum()),
        "events": count_events(record.events),
    }


def payload_figures(record: Record) -> dict[str, Any]:
    """Of a payload in hands. "distance_m": the length of its path; "violation": the largest one of
    each family in its unit (m; forces in 100 N); "apparent_payload_mass_kg": at the end, as a
    planner's observer has it; "solver_ms": the solver's part of a plan. In
    physics those of `physics_figures` too.
    """
    mass = record.more.get("apparent_payload_mass")
    solver = np.sum([record.phases[name] for name in SQP_PHASES], axis=0)
    return {
        "distance_m": distance(record),
        "payload_position_error_m": payload_error(record),
        "violation": {
            family: float(values.max() / unit_of(family))
            for family, values in record.violation.items()
        },
        "equality_violation": float(record.equality_violation.max()),
        "solver_ms": percentiles(solver),
        "apparent_payload_mass_kg": None if mass is None else float(mass[-1]),
        "phases_ms": {name: float(np.median(v)) for name, v in record.phases.items()},
        **(physics_figures(record) if "torque_share" in record.more else {}),
    }


def payload_error(record: Record) -> dict[str, float]:
    """RMS and maximum distance of the payload from its reference once settled, m."""
    settled = record.time >= min(SETTLING_TIME, record.time[-1] / 2)
    error = tracking_error(record).position[settled, 0]
    return {"rms": float(np.sqrt(np.mean(error**2))), "max": float(error.max())}


def distance(record: Record) -> float:
    """Length of the payload's path over the ground, m."""
    return float(np.linalg.norm(np.diff(record.true_bodies[:, 0, :2], axis=0), axis=1).sum())


def fell(record: Record) -> bool:
    """Whether a body leaned too far from its reference, or a robot sank too low."""
    up = np.array([0.0, 0.0, 1.0])
    both = record.bodies, record.references
    axes = [quaternions.rotate(states[..., 3:7], up) for states in both]
    cosine = (axes[0] * axes[1]).sum(axis=-1)
    ground = record.team.ground
    height, wanted = (
        states[:, 1:, 2] - ground.height(states[:, 1:, 0], states[:, 1:, 1]) for states in both
    )
    return bool((cosine < np.cos(FALL_ANGLE)).any() or (height < FALL_HEIGHT * wanted).any())


def percentiles(values: ArrayLike) -> dict[str, float]:
    """p50, p95, p99 and max of `values` [T]."""
    cuts = {"p50": 50, "p95": 95, "p99": 99, "max": 100}
    return {name: float(np.percentile(np.asarray(values), cut)) for name, cut in cuts.items()}
