"""Receding-horizon runs of a team on its nominal model: *kinematic*, no contact physics."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from palanquin.problems.clm.guess import fill_measured
from palanquin.problems.clm.planner import Planner, TeamPlan, TeamState
from palanquin.problems.clm.references import PARTS, Velocity
from palanquin.sim.rollout import Rollout, RolloutBuilder
from palanquin.sim.team import Team

PHASES = ("linearize", "update", "solve", "globalize")


class Command(Protocol):
    """The commanded velocity as a function of time (s)."""

    def __call__(self, time: float) -> Velocity: ...


def run(
    planner: Planner,
    scene_team: Team,
    command: Command,
    duration: float,
    period: float,
    progress: Callable[[int], None] = lambda ticks: None,
) -> Rollout:
    """Plans every `period` (s) for `duration` (s); the nominal model moves by the plan's inputs.

    A foot that lands stays where the plan put it until it lifts off. When a plan is not usable the
    loop goes on with it, and its status stands in the rollout.

    Args:
        planner: plans from a measured state.
        scene_team: the same team as the scene describes it.
        command: velocity of the payload over time.
        duration: s.
        period: s between two plans; any value, the planner's knots need not match it.
        progress: called after every tick with the number of ticks done.
    """
    ticks = round(duration / period)
    builder = RolloutBuilder(
        scene_team,
        planner.dt * np.arange(planner.horizon + 1),
        capacity=ticks,
        phases=PHASES,
        violation=tuple(planner.lowered.policies),
    )
    state = planner.nominal_state()
    for tick in range(ticks):
        time = tick * period
        plan = planner.solve(time, state, command(time))
        state = TeamState(state.bodies, landed_feet(plan, state.feet))
        _log(builder, time, state, plan)
        state = TeamState(nominal_step(planner, plan, state, period), state.feet)
        progress(tick + 1)
    return builder.build()


def landed_feet(plan: TeamPlan, feet: np.ndarray) -> np.ndarray:
    """Where the feet are during the period: the plan's first knot, which keeps standing feet."""
    planned = plan.feet[0]
    return np.where(np.isfinite(planned), planned, feet)


def nominal_step(planner: Planner, plan: TeamPlan, state: TeamState, period: float) -> np.ndarray:
    """Bodies [R+1, 13] after `period` under the plan's first inputs (eq. 4)."""
    knot = planner.lowered.wrap(plan.plan.trajectory.values[0].copy())
    fill_measured(knot, planner.team, state.bodies, state.feet)
    parameters = planner.params.copy()
    parameters["dt"] = period
    moved = planner.lowered.wrap(planner.lowered.step(knot.values, parameters.values[0]))
    return np.stack(
        [np.hstack([moved[f"{body}.{part}"] for part in PARTS]) for body in planner.team.bodies]
    )


def _log(builder: RolloutBuilder, time: float, state: TeamState, plan: TeamPlan) -> None:
    solved = plan.plan
    horizon = len(plan.contacts) - 1
    builder.append(
        time=time,
        x=state.bodies.ravel(),
        reference=plan.references.bodies[0].ravel(),
        contact=plan.contacts[0],
        feet=state.feet,
        force=plan.forces[0],
        hand_wrench=plan.hand_wrenches[0],
        plan_x=plan.bodies.reshape(horizon + 1, -1),
        plan_feet=plan.feet,
        plan_contact=plan.contacts[:-1],
        solve_ms=plan.solve_ms,
        iterations=solved.iteration_count,
        cost=solved.cost,
        equality_violation=solved.equality_violation,
        status=solved.status.name.lower(),
        phases={name: solved.timings_ms[name] for name in PHASES},
        violation=dict(solved.violation),
    )
