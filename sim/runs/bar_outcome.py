"""The figures of a run of robots on bars."""

from __future__ import annotations

from typing import Any

import numpy as np

from palanquin.problems import quaternions
from palanquin.sim.runs.record import Record
from palanquin.sim.scenarios.bars import STANDING_TIME

SETTLING_TIME = 2.0
"""After the first step; velocity errors count from there, s."""


def bar_figures(record: Record) -> dict[str, Any]:
    """Figures of robots on bars, for JSON; those of physics only where there was physics.

    "velocity_error_m_s": of the centres of mass against the command in the heading frame, rms and
    mean over robots and time once settled. "payload_position_error_m": of the bars' middles, in the
    horizontal plane, from the middle of the robots' references. "violation": friction of the
    ground's forces on the feet that the plan asks for, in N; of the bars' length, m.
    """
    extremes = record.extremes
    x = record.bodies[..., 0]
    figures = {
        "distance_m": float((x[-1] - x[0]).min()),
        "velocity_error_m_s": velocity_error(record),
        "bar_length_error_m": extremes["bar_length_error_m"],
        "violation": {
            **{family: float(values.max()) for family, values in record.violation.items()},
            "bar": extremes["bar_length_error_m"],
        },
        "real_time_factor": record.duration / record.wall,
        "assumed_friction": record.team.friction,
    }
    if "bars" in record.more:
        figures["payload_position_error_m"] = payload_error(record)
        figures["torque_fraction_max"] = extremes["torque_fraction"]
        figures["violation"]["torque"] = max(0.0, extremes["torque_fraction"] - 1.0)
        figures["control_ms_mean"] = extremes["control_ms_mean"]
        figures["control_fallbacks"] = int(extremes["control_fallbacks"])
    return figures


def velocity_error(record: Record) -> dict[str, float] | None:
    """Of vx and vy in the heading frame once settled, m/s; None for a run too short to settle."""
    settled = record.time >= STANDING_TIME + SETTLING_TIME
    if not settled.any():
        return None
    bodies, references = record.bodies[settled], record.references[settled]
    back = quaternions.from_yaw(-quaternions.yaw_of(bodies[..., 3:7]))
    error = quaternions.rotate(back, bodies[..., 7:10] - references[..., 7:10])[..., :2]
    return {
        "rms": float(np.sqrt(np.mean(np.sum(error**2, axis=-1)))),
        "mean_x": float(error[..., 0].mean()),
        "mean_y": float(error[..., 1].mean()),
        "stride_rms": float(np.sqrt(np.mean(_per_stride(error, record.period) ** 2) * 2)),
    }


def _per_stride(error: np.ndarray, period: float) -> np.ndarray:
    """Moving mean over one gait cycle of 0.4 s: what is left without the steps' own swaying."""
    window = min(round(0.4 / period), len(error))
    total = np.cumsum(np.concatenate([np.zeros_like(error[:1]), error]), axis=0)
    return np.asarray((total[window:] - total[:-window]) / window)


def payload_error(record: Record) -> dict[str, float]:
    """Rms and maximum over bars and time, m."""
    wanted = record.references[..., :2]
    middles = (wanted[:, :-1] + wanted[:, 1:]) / 2
    errors = np.linalg.norm(record.more["bars"][..., :2] - middles, axis=-1)
    return {"rms": float(np.sqrt(np.mean(np.square(errors)))), "max": float(errors.max())}
