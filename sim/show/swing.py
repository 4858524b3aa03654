"""Paths of the feet: still in stance, cubic splines in swing (CLM paper, IV-B)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palanquin.sim.runs.record import Record

Array = NDArray[np.float64]

APEX_HEIGHT = 0.08
"""How far a swing foot rises over the higher of its two footholds (m)."""


@dataclass(frozen=True)
class Swing:
    """One step: from `lift_off` [3] at `start` to `touchdown` [3] at `end` (m, s)."""

    start: float
    end: float
    lift_off: Array
    touchdown: Array
    apex_height: float = APEX_HEIGHT

    def position(self, time: Array) -> Array:
        """Foot position [..., 3] at `time` [...], clamped to the step.

        Horizontally one cubic, vertically two that meet at the apex at half time; velocities are
        0 at both ends and, vertically, at the apex, so that the path is C1.
        """
        s = np.clip((np.asarray(time, float) - self.start) / (self.end - self.start), 0.0, 1.0)
        share = _cubic(s)[..., None]
        path = (1 - share) * self.lift_off + share * self.touchdown
        z0, z1 = self.lift_off[2], self.touchdown[2]
        apex = max(z0, z1) + self.apex_height
        rise = z0 + (apex - z0) * _cubic(2 * s)
        fall = apex + (z1 - apex) * _cubic(2 * s - 1)
        path[..., 2] = np.where(s < 0.5, rise, fall)
        return path


def _cubic(s: Array) -> Array:
    """The cubic from 0 to 1 over s in [0, 1] with zero slope at both ends."""
    s = np.clip(s, 0.0, 1.0)
    return s * s * (3 - 2 * s)


def swings_of_foot(
    rollout: Record, robot: int, foot: int, apex_height: float = APEX_HEIGHT
) -> list[Swing]:
    """Every step that foot `foot` of robot `robot` takes in `rollout`.

    A step starts with the first tick without contact, where the foot last stood, and ends with the
    next tick of contact at the foothold that it then holds. A step that the run cuts off ends
    where and when the last plan puts it down, or at that plan's end.
    """
    contact = rollout.contact[:, robot, foot] > 0.5
    feet, time = rollout.feet[:, robot, foot], rollout.time
    steps = []
    tick = 0
    while tick < len(time):
        if contact[tick]:
            tick += 1
            continue
        lift_off = feet[max(tick - 1, 0)]
        start = time[tick]
        while tick < len(time) and not contact[tick]:
            tick += 1
        if tick < len(time):
            end, touchdown = time[tick], feet[tick]
        else:
            end, touchdown = _planned_touchdown(rollout, robot, foot)
        steps.append(Swing(float(start), float(end), lift_off, touchdown, apex_height))
    return steps


def _planned_touchdown(rollout: Record, robot: int, foot: int) -> tuple[float, Array]:
    """When (s) and where (m) the last plan lands a foot that swings at the last tick."""
    stance = rollout.plan_contact[-1, :, robot, foot] > 0.5
    knot = int(np.argmax(stance)) if stance.any() else len(stance) - 1
    # A plan without a touchdown ends the step with the horizon.
    end = rollout.time[-1] + rollout.plan_time[knot if stance.any() else knot + 1]
    return float(end), rollout.plan_feet[-1, knot, robot, foot]


def foot_path(
    rollout: Record, robot: int, foot: int, at: Array, apex_height: float = APEX_HEIGHT
) -> Array:
    """World positions [F, 3] (m) of a foot's contact point at the times `at` [F] (s)."""
    tick = np.clip(np.searchsorted(rollout.time, at, side="right") - 1, 0, None)
    path: Array = rollout.feet[tick, robot, foot].copy()
    for step in swings_of_foot(rollout, robot, foot, apex_height):
        inside = (at >= step.start) & (at < step.end)
        path[inside] = step.position(at[inside])
    return path
