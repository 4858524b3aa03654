"""Planning for a team that carries a payload in its hands, as the loop asks for it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from palanquin.plan import SQP_PHASES
from palanquin.problems.clm.planner import Planner
from palanquin.problems.clm.team_plan import TeamPlan, TeamState
from palanquin.sim.runs.loop import Measurement
from palanquin.sim.scenarios.disturbance import mean_wrenches
from palanquin.sim.scenarios.script import Orders

PHASES = ("inputs", *SQP_PHASES)
"""Where the time of a plan goes: references, parameters and warm start, then the solver's work."""


class PayloadPlanner:
    """Leads the payload as ordered. The first plan converges before the clock starts: the team
    still stands and has the time. From then on each call is one call of `Planner.solve`.
    """

    def __init__(self, planner: Planner) -> None:
        self.planner = planner
        self._has_settled = False

    @property
    def plan_time(self) -> NDArray[np.float64]:
        """Times of a plan's knots [N+1], s."""
        return self.planner.dt * np.arange(self.planner.horizon + 1, dtype=np.float64)

    def reference_at(self, time: float) -> NDArray[np.float64]:
        """The payload's (x, y, yaw) [3], m and rad."""
        return self.planner.reference_at(time)

    def plan(self, seen: Measurement, orders: Orders, period: float) -> TeamPlan:
        """Gaits change as ordered, and the planner learns of pushes that it may know."""
        take_orders(self.planner, orders, seen.time)
        state = TeamState(seen.bodies, seen.feet)
        if not self._has_settled:
            self._has_settled = True
            self.planner.settle(seen.time, state, orders.velocity)
        return self.planner.solve(seen.time, state, orders.velocity)

    def row(self, plan: TeamPlan) -> dict[str, Any]:
        """A plan as fields of the record."""
        solved = plan.plan
        return {
            "reference": plan.references.bodies[0].ravel(),
            "contact": plan.contacts[0],
            "force": plan.forces[0],
            "plan_x": plan.bodies.reshape(len(plan.contacts), -1),
            "plan_feet": plan.feet,
            "plan_contact": plan.contacts[:-1],
            "solve_ms": plan.solve_ms,
            "iterations": solved.iteration_count,
            "cost": solved.cost,
            "equality_violation": solved.equality_violation,
            "status": solved.status.name.lower(),
            "usable": solved.is_usable,
            "phases": {
                "inputs": plan.solve_ms - solved.timings_ms["total"],
                **{name: solved.timings_ms[name] for name in SQP_PHASES},
            },
            "violation": dict(solved.violation),
            "more": {"hand_wrench": plan.hand_wrenches[0]},
            "events": plan.events,
        }


def take_orders(planner: Planner, orders: Orders, time: float) -> None:
    """Has gaits change, and tells the planner of pushes that it may know of."""
    for change in orders.gait_changes:
        for name, clock in zip(planner.team.robots, planner.clocks, strict=True):
            if name in (change.robots or (name,)):
                clock.change(change.gait.gait, time, change.at_once)
    knots = time + planner.dt * np.arange(planner.horizon + 1, dtype=np.float64)
    known = [push for push in orders.pushes if push.known]
    planner.expect_wrenches(mean_wrenches(known, planner.team.bodies, knots, planner.dt))
