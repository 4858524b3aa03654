"""The figures of contacts and motors of a payload in hands, where there was physics."""

from __future__ import annotations

from typing import Any

import numpy as np

from palanquin.sim.runs.record import Record

SATURATED = 0.999
"""Share of its limit from which on a torque counts as at it."""


def physics_figures(record: Record) -> dict[str, Any]:
    """For JSON. "torque_fraction_max": of the limits, at all control periods; "saturated_share": of
    motors and ticks at their limit; "slip_m": the farthest that a foot slid in one contact;
    "contact_force_max_n": along the normal, of a foot; "control_ms_mean": of a robot's controller;
    "control_fallbacks": its periods without a solution.
    """
    extremes = record.extremes
    return {
        "torque_fraction_max": extremes["torque_fraction"],
        "saturated_share": float((np.abs(record.more["torque_share"]) > SATURATED).mean()),
        "slip_m": extremes["slip_m"],
        "contact_force_max_n": extremes["contact_force_n"],
        "control_ms_mean": extremes["control_ms_mean"],
        "control_fallbacks": int(extremes["control_fallbacks"]),
        "real_time_factor": record.duration / record.wall,
    }
