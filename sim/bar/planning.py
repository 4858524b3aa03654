"""Between simulation and planner: what is measured, and what a plan asks of the robots."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from palanquin import _sim
from palanquin.problems import quaternions
from palanquin.problems.layered.planner import Desired, LayeredPlan, RobotStates
from palanquin.sim.bar.targets import Reference

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


def bodies_of(seen: Sequence[_sim.RobotObservation]) -> Array:
    """States [M, 13] of observed robots: position of the centre of mass, orientation (w, x, y, z),
    velocity (world), angular velocity (body).
    """
    parts = [(o.position, o.orientation, o.velocity, o.rate) for o in seen]
    return np.array([np.concatenate(part) for part in parts])


def measured(bodies: Array, seen: Sequence[_sim.RobotObservation], standing: Flags) -> RobotStates:
    """The planner's view of robots in states `bodies` [M, 13] of which the feet `standing` [M, 4]
    are on the ground: those are where they are, the others where they will land.
    """
    feet = np.array([robot.feet for robot in seen])
    footholds = np.array([robot.footholds for robot in seen])
    return RobotStates(
        position=bodies[:, :3],
        velocity=bodies[:, 7:10],
        rotation=quaternions.matrix(bodies[:, 3:7]),
        angular_velocity=bodies[:, 10:13],
        feet=np.where(standing[..., None], feet, footholds),
    )


def desired(references: Sequence[Reference]) -> Desired:
    """What the planner is to aim at."""
    return Desired(
        position=np.array([r.position for r in references]),
        velocity=np.array([r.velocity for r in references]),
        rotation=np.array([_turn(r.yaw) for r in references]),
        angular_velocity=np.array([[0.0, 0.0, r.yaw_rate] for r in references]),
    )


def _turn(yaw: float) -> list[list[float]]:
    """Rotation matrix about z."""
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return [[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]]


def next_bodies(plan: LayeredPlan, bodies: Array) -> Array:
    """The plan's states [M, 13] at the next knot; its rotations are about the measured ones."""
    turn = quaternions.from_rotation_vector(plan.states[1, :, 6:9])
    orientation = quaternions.multiply(bodies[:, 3:7], turn)
    return np.hstack([plan.position, orientation, plan.velocity, plan.angular_velocity])


def targets(
    plan: LayeredPlan, bodies: Array, planned: Array, references: Sequence[Reference]
) -> list[_sim.RobotTarget]:
    """What the controllers are given for the period from the plan's time on.

    `bodies` and `planned` [M, 13] are now and at the next knot. The accelerations are those that
    the plan's forces, gravity and bars give: the change of velocity over the period.
    """
    rates = (planned[:, 7:13] - bodies[:, 7:13]) / plan.dt
    result = []
    for i, reference in enumerate(references):
        target = _sim.RobotTarget()
        target.time = plan.time + plan.dt
        target.position, target.orientation = planned[i, :3], planned[i, 3:7]
        target.velocity, target.rate = planned[i, 7:10], planned[i, 10:13]
        target.acceleration, target.rate_derivative = rates[i, :3], rates[i, 3:]
        target.forces = plan.forces[i]
        target.commanded_velocity = reference.velocity
        target.commanded_yaw_rate = reference.yaw_rate
        result.append(target)
    return result
