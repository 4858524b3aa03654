"""What the simulation asks of a planner, and how a plan becomes the robots' targets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from palanquin import _sim
from palanquin.sim.bar.targets import Reference

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class TeamMotion:
    """The plan's next state and forces.

    Attributes:
        states: at the next planning instant, [M, 13]: position of the centre of mass, orientation
            (w, x, y, z), velocity (all world), angular velocity (body).
        forces: of the ground on the feet until then, N, world, [M, 4, 3].
        multipliers: of the bars, N/m, [number]; empty if the planner knows none.
        usable: false when this is not the result of a solve that succeeded.
        solve_ms: time of the planner, ms.
    """

    states: Array
    forces: Array
    multipliers: Array
    usable: bool
    solve_ms: float


class Planner(Protocol):
    """Plans for the whole team from what is measured, once every `dt`."""

    @property
    def dt(self) -> float:
        """Time between two knots, and between two calls, s."""

    @property
    def horizon(self) -> int:
        """N."""

    def plan(
        self, time: float, states: Array, feet: Array, contacts: Flags, desired: Array
    ) -> TeamMotion:
        """A motion from `states` [M, 13] with feet at `feet` [M, 4, 3] (m), which stand as
        `contacts` [N + 1, M, 4] says, towards `desired` [N + 1, M, 13].
        """


def states_of(seen: Sequence[_sim.RobotObservation]) -> Array:
    """States [M, 13] of observed robots."""
    parts = [(o.position, o.orientation, o.velocity, o.rate) for o in seen]
    return np.array([np.concatenate(part) for part in parts])


def target_of(
    motion: TeamMotion, robot: int, seen: _sim.RobotObservation, reference: Reference,
    time: float, dt: float,
) -> _sim.RobotTarget:  # fmt: skip
    """What robot `robot`'s controller is given for the period from `time` on.

    The accelerations are what the plan does to the measured velocities within the period.
    """
    state = motion.states[robot]
    target = _sim.RobotTarget()
    target.time = time + dt
    target.position, target.orientation = state[:3], state[3:7]
    target.velocity, target.rate = state[7:10], state[10:13]
    target.acceleration = (state[7:10] - seen.velocity) / dt
    target.rate_derivative = (state[10:13] - seen.rate) / dt
    target.forces = motion.forces[robot]
    target.commanded_velocity, target.commanded_yaw_rate = reference.velocity, reference.yaw_rate
    return target
