"""Receding-horizon runs of a team on its nominal model: *kinematic*, no contact physics."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count, islice

import numpy as np

from palanquin.plan import SQP_PHASES
from palanquin.problems.clm.planner import Planner
from palanquin.problems.clm.team_plan import TeamPlan, TeamState
from palanquin.sim.errors import InputError
from palanquin.sim.rollout import Rollout, RolloutBuilder
from palanquin.sim.scenarios.disturbance import mean_wrenches
from palanquin.sim.scenarios.script import Director, Orders
from palanquin.sim.team import Team

PHASES = ("inputs", *SQP_PHASES)
"""Where the time of a plan goes: references, parameters and warm start, then the solver's work."""

MOST_TICKS = 50_000
"""Of a run: its record takes about 12 kB a tick."""


@dataclass(frozen=True)
class Tick:
    """One period: its start (s), the state then (landed feet on their footholds), plan, orders, and
    the mean force and torque of pushes on each body [R+1, 6] (N, N m).
    """

    time: float
    state: TeamState
    plan: TeamPlan
    orders: Orders
    wrenches: np.ndarray


def run(
    planner: Planner,
    scene_team: Team,
    director: Director,
    duration: float,
    period: float,
    start: TeamState | None = None,
    progress: Callable[[int], None] = lambda ticks: None,
) -> Rollout:
    """Plans every `period` (s) for `duration` (s); the nominal model moves by the plan's inputs.

    The first plan converges before the clock starts: the team still stands and has the time. From
    then on each tick gets one call of `Planner.solve`. A foot that lands stays where the plan put
    it until it lifts off. A plan that is not usable is the last one, shifted by the time that has
    passed: the loop goes on with it, and its status stands in the rollout. The run ends early when
    the model's state has left the finite numbers.

    Args:
        planner: plans from a measured state; not used before.
        scene_team: the same team as the scene describes it.
        director: gives each tick's command, gait changes and pushes. The model suffers every push,
            the planner knows beforehand of those that say so.
        duration: s.
        period: s between two plans; any value, the planner's knots need not match it.
        start: state at time 0; standing nominally unless told.
        progress: called after every tick with the number of ticks done.

    Raises:
        InputError: duration or period is not positive, or there is no period in the duration.
    """
    most = number_of_ticks(duration, period)
    builder = RolloutBuilder(
        scene_team,
        planner.dt * np.arange(planner.horizon + 1, dtype=np.float64),
        capacity=most,
        phases=PHASES,
        violation=tuple(planner.lowered.policies),
    )
    for tick in islice(ticks(planner, director, period, start), most):
        _log(builder, tick)
        progress(len(builder))
    return builder.build()


def ticks(
    planner: Planner, director: Director, period: float, start: TeamState | None = None
) -> Iterator[Tick]:
    """Plans every `period` (s) until the model's state has left the finite numbers; as of `run`."""
    state = start or planner.nominal_state()
    orders = begin_tick(planner, director, 0.0, period)
    planner.settle(0.0, state, orders.velocity)
    for n in count():
        time = n * period
        if n > 0:
            orders = begin_tick(planner, director, time, period)
        plan = planner.solve(time, state, orders.velocity)
        state = TeamState(state.bodies, landed_feet(plan, state.feet))
        wrenches = pushed(planner, orders, time, period)
        yield Tick(time, state, plan, orders, wrenches)
        state = TeamState(
            nominal_step(planner, plan, state, period, wrenches),
            feet_after(planner, plan, state.feet, time + period),
        )
        if not np.isfinite(state.bodies).all():
            break


def number_of_ticks(duration: float, period: float) -> int:
    """How many periods fit into a duration (s); raises InputError when that makes no sense."""
    for name, value in (("duration", duration), ("period", period)):
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{name}: {value} s must be positive and finite")
    periods = duration / period
    if not 0.5 < periods < MOST_TICKS + 0.5:
        raise InputError(
            f"duration: {duration} s has {np.rint(periods):g} periods of {period:g} s; "
            f"it must have from 1 to {MOST_TICKS}"
        )
    return round(periods)


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


def begin_tick(planner: Planner, director: Director, time: float, period: float) -> Orders:
    """The orders of a tick; gaits change, and the planner learns of pushes that it may know."""
    orders = director.at(time, planner.reference_at(time), period)
    for change in orders.gait_changes:
        for name, clock in zip(planner.team.robots, planner.clocks, strict=True):
            if name in (change.robots or (name,)):
                clock.change(change.gait.gait, time, change.at_once)
    knots = time + planner.dt * np.arange(planner.horizon + 1, dtype=np.float64)
    known = [push for push in orders.pushes if push.known]
    planner.expect_wrenches(mean_wrenches(known, planner.team.bodies, knots, planner.dt))
    return orders


def pushed(planner: Planner, orders: Orders, time: float, period: float) -> np.ndarray:
    """Mean force and torque of all pushes on the bodies during a period, [R+1, 6]."""
    return mean_wrenches(orders.pushes, planner.team.bodies, np.array([time]), period)[0]


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


def _log(builder: RolloutBuilder, tick: Tick) -> None:
    plan, state, solved = tick.plan, tick.state, tick.plan.plan
    horizon = len(plan.contacts) - 1
    builder.append(
        time=tick.time,
        x=state.bodies.ravel(),
        reference=plan.references.bodies[0].ravel(),
        contact=plan.contacts[0],
        feet=state.feet,
        force=plan.forces[0],
        hand_wrench=plan.hand_wrenches[0],
        disturbance=tick.wrenches,
        plan_x=plan.bodies.reshape(horizon + 1, -1),
        plan_feet=plan.feet,
        plan_contact=plan.contacts[:-1],
        solve_ms=plan.solve_ms,
        iterations=solved.iteration_count,
        cost=solved.cost,
        equality_violation=solved.equality_violation,
        status=solved.status.name.lower(),
        phases={
            "inputs": plan.solve_ms - solved.timings_ms["total"],
            **{name: solved.timings_ms[name] for name in SQP_PHASES},
        },
        violation=dict(solved.violation),
        events=plan.events,
    )
