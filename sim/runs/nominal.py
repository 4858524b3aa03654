"""The planner's nominal model as the plant: *kinematic*, no contact physics."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from palanquin.events import Event
from palanquin.problems.clm.planner import Planner
from palanquin.problems.clm.team_plan import TeamPlan, TeamState
from palanquin.problems.planning import Measurement
from palanquin.sim.scenarios.disturbance import mean_wrenches
from palanquin.sim.scenarios.script import Orders


class NominalPlant:
    """A team and its payload, moved by the plan's inputs through the planner's own dynamics.

    A foot that lands stays where the plan put it until it lifts off. It can't go on when its state
    has left the finite numbers.

    Args:
        planner: whose model it is.
        start: state at time 0; standing nominally unless told.
        period: s between two plans.
    """

    def __init__(self, planner: Planner, period: float, start: TeamState | None = None) -> None:
        self._planner, self._period, self._ticks = planner, period, 0
        self.state = start or planner.nominal_state()
        self._plan: TeamPlan | None = None
        self._wrenches = np.zeros((len(planner.team.bodies), 6))

    @property
    def time(self) -> float:
        """Now, s."""
        return self._ticks * self._period

    @property
    def events(self) -> tuple[Event, ...]:
        """None: there is nothing that could break."""
        return ()

    @property
    def fall(self) -> str:
        """Says when the state has left the finite numbers."""
        return "" if np.isfinite(self.state.bodies).all() else "the plan diverged"

    def measure(self) -> Measurement:
        """The state itself."""
        bodies, feet = self.state.bodies, self.state.feet
        robots = bodies[1:]
        ground = self._planner.terrain.height(robots[:, 0], robots[:, 1])
        return Measurement(self.time, bodies, feet, feet, np.asarray(ground))

    def apply(self, plan: TeamPlan, seen: Measurement) -> Measurement:
        """Feet stand where the plan's first knot has them."""
        self._plan = plan
        self.state = TeamState(seen.bodies, landed_feet(plan, seen.feet))
        return replace(seen, feet=self.state.feet)

    def advance(self, period: float, orders: Orders) -> None:
        """By the plan's inputs, under all pushes."""
        planner, plan, state = self._planner, self._plan, self.state
        if plan is None:
            raise RuntimeError("a plan must be applied before the model moves")
        times = np.array([self.time])
        self._wrenches = mean_wrenches(orders.pushes, planner.team.bodies, times, period)[0]
        self._ticks += 1
        self.state = TeamState(
            nominal_step(planner, plan, state, period, self._wrenches),
            feet_after(planner, plan, state.feet, self.time),
        )

    def values(self) -> dict[str, np.ndarray]:
        """Mean force and torque of all pushes during the last period, [B, 6]."""
        return {"disturbance": self._wrenches}

    def extremes(self) -> dict[str, float]:
        """None beyond what the record has."""
        return {}


def follow(
    planner: Planner, plan: TeamPlan, state: TeamState, period: float
) -> tuple[TeamState, TeamState]:
    """A measured `state` with the feet that its `plan` puts down, and what becomes of it within a
    `period` (s) of nobody's pushing: a loop's tick, for who measures, disturbs and counts himself.
    """
    now = TeamState(state.bodies, landed_feet(plan, state.feet))
    bodies = nominal_step(planner, plan, now, period)
    return now, TeamState(bodies, feet_after(planner, plan, now.feet, plan.time + period))


def landed_feet(plan: TeamPlan, feet: np.ndarray) -> np.ndarray:
    """Where the feet are during the period: the plan's first knot, which keeps standing feet."""
    planned = plan.feet[0]
    return np.where(np.isfinite(planned), planned, feet)


def feet_after(planner: Planner, plan: TeamPlan, feet: np.ndarray, time: float) -> np.ndarray:
    """Feet [R, 4, 3] at the next tick, `time`: what landed on the way stands on its foothold.

    A foot that lands at the tick itself is still free, and gets its foothold from the next plan.
    """
    just_before = time - 1e-3 * planner.dt
    standing = planner.contacts(np.array([just_before]))[0]
    last = min(int((just_before - plan.time) / planner.dt), planner.horizon - 1)
    stood = plan.contacts[: last + 1].all(axis=0)
    # A foot that lands after the last knot has its foothold at the next one at which it stands.
    following = np.minimum(last + 1 + plan.contacts[last + 1 :].argmax(axis=0), planner.horizon - 1)
    knots = np.where(plan.contacts[last], last, following)
    footholds = np.take_along_axis(plan.feet, knots[None, ..., None], axis=0)[0]
    return np.where((standing & ~stood)[..., None], footholds, feet)


def nominal_step(
    planner: Planner,
    plan: TeamPlan,
    state: TeamState,
    period: float,
    wrenches: np.ndarray | None = None,
) -> np.ndarray:
    """Bodies [R+1, 13] after `period` (s, at most the horizon's length) under the plan's inputs, an
    Euler step (4) for each interval that it begins, and under `wrenches` [R+1, 6] (force, torque,
    world) that disturb them; none unless told.
    """
    columns = planner.columns
    parameters = planner.params.copy()
    for b, body in enumerate(planner.team.bodies):
        wrench = np.zeros(6) if wrenches is None else wrenches[b]
        parameters[f"{body}.external_force"] = wrench[:3]
        parameters[f"{body}.external_torque"] = wrench[3:]
    bodies = state.bodies
    for k, length in enumerate(_intervals(planner, period)):
        knot = plan.plan.xs[k].copy()
        knot[columns.bodies] = bodies
        if k == 0:
            knot[columns.feet] = state.feet
        parameters["dt"] = length
        bodies = planner.lowered.step(knot, parameters.values[k])[columns.bodies]
    return bodies


def _intervals(planner: Planner, period: float) -> Iterator[float]:
    """How long the inputs of each of the plan's intervals act within a `period`, s."""
    for k in range(planner.horizon):
        length = min(planner.dt, period - k * planner.dt)
        if k > 0 and length < 1e-9 * planner.dt:
            return
        yield length
