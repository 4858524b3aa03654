"""The figures of contacts and motors of a payload in hands, where there was physics."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from palanquin.events import EventKind
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.tracking import estimation_error

SATURATED = 0.999
"""Share of its limit from which on a torque counts as at it."""

BEARS = 20.0
"""Force from which on a foot has come down, N."""


def physics_figures(record: Record) -> dict[str, Any]:
    """For JSON. "torque_fraction_max": of the limits, at all control periods; "saturated_share": of
    motors and ticks at their limit; "slip_m": the farthest that a foot slid in one contact;
    "contact_force_max_n": along the normal, of a foot; "control_ms_mean": of a robot's controller;
    "control_fallbacks": its periods without a solution; "touchdowns": how many, and how many of
    them inside a ditch, the deepest one by so many m; "collisions": "steps" in which anything but a
    foot touched anything, and what was the "first"; "plans": how many were "lost", and how old the
    measurement became whose plan was followed; "faults": what broke and when. Where the state
    is not known also "estimation_error" of payload and robots, see `estimation_figures`.
    """
    extremes = record.extremes
    is_hidden = "true_bodies" in record.more
    return {
        "torque_fraction_max": extremes["torque_fraction"],
        "saturated_share": float((np.abs(record.more["torque_share"]) > SATURATED).mean()),
        "slip_m": extremes["slip_m"],
        "contact_force_max_n": extremes["contact_force_n"],
        "control_ms_mean": extremes["control_ms_mean"],
        "control_fallbacks": int(extremes["control_fallbacks"]),
        "touchdowns": _touchdown_figures(record),
        "collisions": {
            "steps": int(extremes["collisions"]),
            "first": next(iter(_reasons(record, EventKind.COLLISION)), None),
        },
        "plans": {
            "lost": int(extremes["lost_plans"]),
            "oldest_s": extremes["oldest_plan_s"],
        },
        "real_time_factor": record.duration / record.wall,
        "faults": _reasons(record, EventKind.FAULT),
        **({"estimation_error": estimation_figures(record)} if is_hidden else {}),
    }


def estimation_figures(record: Record) -> dict[str, dict[str, float]]:
    """How wrong payload and robots are taken to be, from the start on: RMS and maximum of position
    (m), orientation (rad) and velocity (m/s), over all robots.
    """
    error = estimation_error(record)
    return {
        who: {
            f"{name}_{how}": float(measure(values[:, bodies]))
            for name, values in vars(error).items()
            for how, measure in (("rms", _rms), ("max", np.max))
        }
        for who, bodies in (("payload", slice(1)), ("robots", slice(1, None)))
    }


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _reasons(record: Record, kind: EventKind) -> list[dict[str, Any]]:
    return [{"time_s": e.time, "what": e.reason} for e in record.events if e.kind is kind]


def _touchdown_figures(record: Record) -> dict[str, float]:
    feet = touchdowns(record)
    depths = [depth_in_ditch(feet[:, :2], *asdict(d).values()) for d in record.team.ditches]
    deepest = np.max(depths, axis=0, initial=0.0) if depths else np.zeros(len(feet))
    return {
        "count": len(feet),
        "in_ditches": int((deepest > 0).sum()),
        "deepest_m": float(deepest.max(initial=0.0)),
    }


def touchdowns(record: Record) -> np.ndarray:
    """Where feet came to stand and bore [n, 3], m, those that stood at the start left out."""
    loads = np.linalg.norm(record.more["foot_force"], axis=-1)
    bears = (record.contact > 0.5) & (loads > BEARS)
    places = []
    for robot, foot in np.ndindex(bears.shape[1:]):
        begins = np.flatnonzero(np.diff(bears[:, robot, foot].astype(int)) > 0) + 1
        places.append(record.true_feet[np.minimum(begins + 1, len(bears) - 1), robot, foot])
    return np.concatenate(places)


def depth_in_ditch(points: np.ndarray, a: float, b: float, c: float, width: float) -> np.ndarray:
    """How far points [n, 2] are from the nearer edge of a ditch, positive inside, m."""
    distance = np.abs(points @ np.array([a, b]) + c) / np.hypot(a, b)
    return np.asarray(width / 2 - distance)
