"""The figures of a run of bar carriers, as numbers."""

from __future__ import annotations

from typing import Any

import numpy as np

from palanquin.problems import quaternions
from palanquin.sim.bar.run import BarRun
from palanquin.sim.bar.scenario import STANDING_TIME
from palanquin.sim.outcome import percentiles

SETTLING_TIME = 2.0
"""After the first step; velocity errors count from there, s."""


def outcome(run: BarRun) -> dict[str, Any]:
    """What a run amounts to; for JSON.

    "completed": to the end of the duration or of the distance, without a fall.
    "velocity_error_m_s": of the centres of mass against the command in the heading frame, rms and
    mean over robots and time once settled. "payload_position_error_m": of the bars' middles, in the
    horizontal plane, from the middle of the robots' references. "violation": friction of the
    ground's forces on the feet that the plan asks for, in N; of the bars' length, m.
    """
    scenario, ticks, extremes = run.scenario, run.ticks, run.extremes
    period = 1e3 * run.period
    return {
        "completed": not run.fall,
        "fell": bool(run.fall),
        "fall": {"time_s": run.duration, "cause": run.fall} if run.fall else None,
        "duration_s": run.duration,
        "distance_m": float((ticks.state[-1, :, 0] - ticks.state[0, :, 0]).min()),
        "velocity_error_m_s": velocity_error(run),
        "payload_position_error_m": payload_error(run),
        "bar_length_error_m": extremes.bar_length_error,
        "torque_fraction_max": extremes.torque_fraction,
        "violation": {
            "friction": friction_violation(run),
            "bar": extremes.bar_length_error,
            "torque": max(0.0, extremes.torque_fraction - 1.0),
        },
        "solve_ms": percentiles(ticks.solve_ms),
        "deadline_misses": int((ticks.solve_ms > period).sum()),
        "fallbacks": int((~ticks.usable).sum()),
        "control_ms_mean": extremes.control_ms / extremes.control_periods,
        "control_fallbacks": extremes.fallbacks,
        "real_time_factor": run.duration / run.wall,
        "assumed_friction": scenario.assumed_friction,
    }


def velocity_error(run: BarRun) -> dict[str, float] | None:
    """Of vx and vy in the heading frame once settled, m/s; None for a run too short to settle."""
    ticks = run.ticks
    settled = ticks.time >= STANDING_TIME + SETTLING_TIME
    if not settled.any():
        return None
    yaw = quaternions.yaw_of(ticks.state[settled, :, 3:7])
    back = quaternions.from_yaw(-yaw)
    difference = ticks.state[settled, :, 7:10] - ticks.desired[settled, :, 7:10]
    error = quaternions.rotate(back, difference)[..., :2]
    return {
        "rms": float(np.sqrt(np.mean(np.sum(error**2, axis=-1)))),
        "mean_x": float(error[..., 0].mean()),
        "mean_y": float(error[..., 1].mean()),
        "stride_rms": float(np.sqrt(np.mean(_per_stride(error, run.period) ** 2) * 2)),
    }


def _per_stride(error: np.ndarray, period: float) -> np.ndarray:
    """Moving mean over one gait cycle of 0.4 s: what is left without the steps' own swaying."""
    window = min(round(0.4 / period), len(error))
    total = np.cumsum(np.concatenate([np.zeros_like(error[:1]), error]), axis=0)
    return np.asarray((total[window:] - total[:-window]) / window)


def payload_error(run: BarRun) -> dict[str, float]:
    """Rms and maximum over bars and time, m."""
    model, ticks = run.scene.model, run.ticks
    errors = []
    for bar in range(run.scenario.team.robots - 1):
        address = int(model.joint(f"bar{bar + 1}").qposadr[0])
        middle = ticks.desired[:, bar : bar + 2, :2].mean(axis=1)
        errors.append(np.linalg.norm(ticks.qpos[:, address : address + 2] - middle, axis=1))
    return {"rms": float(np.sqrt(np.mean(np.square(errors)))), "max": float(np.max(errors))}


def friction_violation(run: BarRun) -> float:
    """By how much the planned forces leave the pyramid of (9), N."""
    force = run.ticks.planned_force
    limit = run.scenario.assumed_friction / np.sqrt(2) * force[..., 2]
    return float(max(0.0, (np.abs(force[..., :2]).max(axis=-1) - limit).max()))
