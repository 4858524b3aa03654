"""Planning for robots on bars, as the loop asks for it: references, contacts, then the QP."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palanquin.events import Event
from palanquin.problems import quaternions
from palanquin.problems.layered.planner import Desired, LayeredPlan, Planner, RobotStates
from palanquin.sim.runs.bar_reference import Leash, Reference
from palanquin.sim.runs.loop import Measurement
from palanquin.sim.scenarios.script import Orders

Array = NDArray[np.float64]
Schedule = Callable[[Array], NDArray[np.bool_]]
"""Contact flags [n, R, 4] at times [n] (s): the clock of those who move the feet."""


@dataclass(frozen=True)
class BarPlan:
    """A plan, with what it was planned for.

    Attributes:
        plan: of the layered planner.
        seen: the measurement.
        contacts: flags [N+1, R, 4] at the knots.
        feet: [R, 4, 3], m, world: where they are, or will stand.
        references: of the robots.
        events: what the planner could not do at this tick.
    """

    plan: LayeredPlan
    seen: Measurement
    contacts: NDArray[np.bool_]
    feet: Array
    references: tuple[Reference, ...]
    events: tuple[Event, ...]

    @cached_property
    def bodies(self) -> Array:
        """States [N+1, R, 13]: the first as measured, and all rotations about the measured ones."""
        states = self.plan.states
        turn = quaternions.from_rotation_vector(states[..., 6:9])
        orientation = quaternions.multiply(self.seen.bodies[:, 3:7], turn)
        return np.concatenate(
            [states[..., 0:3], orientation, states[..., 3:6], states[..., 9:12]], axis=-1
        )


class BarPlanner:
    """Leads each robot at its own velocity, as ordered.

    Args:
        planner: any of the layered ones.
        schedule: which feet stand when.
        leash: how far references may run ahead of the robots.
    """

    def __init__(self, planner: Planner, schedule: Schedule, leash: Leash) -> None:
        self.planner = planner
        self._schedule, self._leash = schedule, leash
        self.references: tuple[Reference, ...] = ()
        self._told = 0

    @property
    def plan_time(self) -> Array:
        """Times of a plan's knots [N+1], s."""
        settings = self.planner.settings
        return settings.dt * np.arange(settings.horizon + 1, dtype=np.float64)

    def reference_at(self, time: float) -> Array:
        """The first robot's (x, y, yaw) [3], m and rad."""
        if not self.references:
            return np.zeros(3)
        first = self.references[0]
        return np.array([*first.position[:2], first.yaw])

    def plan(self, seen: Measurement, orders: Orders, period: float) -> BarPlan:
        """Moves the references on, and plans from what is seen."""
        robots = range(len(seen.bodies))
        if not self.references:
            self.references = tuple(Reference.at(seen.bodies[i], self._leash) for i in robots)
        for i, reference in zip(robots, self.references, strict=True):
            reference.advance(orders.of(i), seen.bodies[i], float(seen.ground[i]), period)
        contacts = self._schedule(seen.time + self.plan_time)
        feet = np.where(contacts[0][..., None], seen.feet, seen.footholds)
        plan = self.planner.plan(
            seen.time, _states(seen.bodies, feet), contacts, _desired(self.references)
        )
        events = tuple(self.planner.events[self._told :])
        self._told += len(events)
        still = tuple(reference.copy() for reference in self.references)
        return BarPlan(plan, seen, contacts, feet, still, events)

    def row(self, plan: BarPlan) -> dict[str, Any]:
        """A plan as fields of the record; violation of friction in N."""
        layered, horizon = plan.plan, len(plan.contacts) - 1
        force = layered.forces
        cone = self.planner.settings.friction / np.sqrt(2) * force[..., 2]
        return {
            "reference": np.concatenate([reference.body for reference in plan.references]),
            "contact": plan.contacts[0],
            "force": force,
            "plan_x": plan.bodies.reshape(horizon + 1, -1),
            "plan_feet": np.broadcast_to(plan.feet, (horizon, *plan.feet.shape)),
            "plan_contact": plan.contacts[:-1],
            "solve_ms": layered.solve_ms,
            "iterations": np.nan,
            "cost": sum(layered.cost) if layered.cost else np.nan,
            "equality_violation": np.nan,
            "status": layered.status,
            "usable": layered.is_usable,
            "violation": {
                "friction": max(0.0, float((np.abs(force[..., :2]).max(axis=-1) - cone).max()))
            },
            "more": {"estimates": layered.estimates},
            "events": plan.events,
        }


def _states(bodies: Array, feet: Array) -> RobotStates:
    return RobotStates(
        position=bodies[:, :3],
        velocity=bodies[:, 7:10],
        rotation=quaternions.matrix(bodies[:, 3:7]),
        angular_velocity=bodies[:, 10:13],
        feet=feet,
    )


def _desired(references: tuple[Reference, ...]) -> Desired:
    return Desired(
        position=np.array([r.position for r in references]),
        velocity=np.array([r.velocity for r in references]),
        rotation=np.array([r.rotation for r in references]),
        angular_velocity=np.array([[0.0, 0.0, r.yaw_rate] for r in references]),
    )
