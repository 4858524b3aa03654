"""The closed loop, once for all: measure, plan, apply, advance."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import islice
from time import perf_counter
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from palanquin.events import Event, EventKind
from palanquin.problems.planning import Measurement, Plan, Planner
from palanquin.sim.errors import InputError
from palanquin.sim.runs.record import Record, RecordBuilder, RecordedTeam
from palanquin.sim.scenarios.disturbance import mean_wrenches
from palanquin.sim.scenarios.script import Director, Orders

Array = NDArray[np.float64]

MOST_TICKS = 50_000
"""Of a run with a payload in hands: its record takes about 12 kB a tick."""


class Plant(Protocol):
    """What moves: the planner's own model, rigid bodies on bars, or robots in full physics."""

    @property
    def time(self) -> float:
        """Now, s."""

    @property
    def fall(self) -> str:
        """Why it can't go on, in words; empty as long as it can."""

    @property
    def events(self) -> tuple[Event, ...]:
        """What befell it since the measurement before, that one included."""

    def measure(self) -> Measurement:
        """What its sensors tell now."""

    def apply(self, plan: Any, seen: Measurement) -> Measurement:
        """Takes a plan for what was `seen`; returns it with the feet where the plan has them."""

    def advance(self, period: float, orders: Orders) -> None:
        """Moves on by `period` (s) under the plan and what is pushed."""

    def values(self) -> dict[str, Array]:
        """What it alone can tell of the last period, by name; see `Record.more`."""

    def extremes(self) -> dict[str, float]:
        """Worst values of the whole run so far, by name with their units."""


@dataclass(frozen=True)
class Tick:
    """One period that has gone by.

    Attributes:
        seen: at its start, feet that the plan has put down included.
        plan: for it.
        orders: that it was made for.
        values: the plant's, by name.
        events: what befell the plant, and what the planner did other than full steps.
    """

    seen: Measurement
    plan: Plan
    orders: Orders
    values: dict[str, Array]
    events: tuple[Event, ...] = ()

    @property
    def time(self) -> float:
        """Of its start, s."""
        return self.seen.time


@dataclass(frozen=True)
class Loop:
    """All who take part in a run.

    Attributes:
        plant: what moves, at its start.
        planner: plans from what is measured; not used before.
        director: gives each tick's commands, gait changes and pushes.
        team: who moves, for names and for the record.
        period: s between two plans; any value, the planner's knots need not match it.
        most: ticks of a run, 1 or more.
        is_over: of the first and the last tick, whether the run has come to its end.
    """

    plant: Plant
    planner: Planner
    director: Director
    team: RecordedTeam
    period: float
    most: int
    is_over: Callable[[Tick, Tick], bool] = lambda first, last: False

    def ticks(self) -> Iterator[Tick]:
        """Plans every period until the plant can't go on or the director ends it. What is not
        measured in numbers is not planned from: the last plan goes on.
        """
        plant, planner = self.plant, self.planner
        last: Tick | None = None
        while not plant.fall:
            seen = plant.measure()
            pose = planner.reference_at(seen.time)
            orders = self.director.at(seen.time, pose, self.period)
            if orders is None:
                return
            take_orders(planner, orders, seen.time, self.team)
            events: tuple[Event, ...]
            if last and not seen.is_finite:
                seen, plan = replace(last.seen, time=seen.time), last.plan
                events = (Event(seen.time, EventKind.NO_STATE, "what was measured is not finite"),)
            else:
                plan = planner.plan(seen, orders)
                seen, events = plant.apply(plan, seen), plan.events
            happened = plant.events + events
            plant.advance(self.period, orders)
            last = Tick(seen, plan, orders, plant.values(), happened)
            yield last

    def run(self, progress: Callable[[int], None] = lambda ticks: None) -> Record:
        """Runs until the most ticks are done, it is over, the plant has fallen, or what is told
        ends it; `progress` is called after every tick with the number of ticks done.

        A plan that is not usable is the last one, shifted by the time that has passed: the loop
        goes on with it, and its status stands in the record.
        """
        builder = RecordBuilder(self.team, self.planner.plan_time)
        start, first = perf_counter(), None
        for tick in islice(self.ticks(), self.most):
            seen, plan, first = tick.seen, tick.plan, first or tick
            more = {**plan.more, **tick.values}
            x = seen.bodies.ravel()
            fields = {**as_fields(plan), "events": tick.events}
            builder.append(time=seen.time, x=x, feet=seen.feet, more=more, **fields)
            progress(len(builder))
            if self.is_over(first, tick):
                break
        return builder.build(
            period=self.period,
            duration=self.plant.time,
            fall=self.plant.fall,
            wall=perf_counter() - start,
            extremes=self.plant.extremes(),
        )


def take_orders(planner: Planner, orders: Orders, time: float, team: RecordedTeam) -> None:
    """Has gaits change, and tells the planner of pushes that it may know of."""
    for robot, change in orders.changes_of(team.names):
        planner.change_gait(robot, change.gait.gait, time, change.at_once)
    known = [push for push in orders.pushes if push.known]
    knots = planner.plan_time
    planner.expect_wrenches(mean_wrenches(known, team.bodies, time + knots, float(knots[1])))


def as_fields(plan: Plan) -> dict[str, Any]:
    """A plan as fields of `Record`."""
    return {
        "reference": plan.reference.ravel(),
        "contact": plan.contacts[0],
        "force": plan.forces[0],
        "plan_x": plan.bodies.reshape(len(plan.contacts), -1),
        "plan_feet": plan.feet,
        "plan_contact": plan.contacts[:-1],
        "solve_ms": plan.solve_ms,
        "iterations": plan.iterations,
        "cost": plan.cost,
        "equality_violation": plan.equality_violation,
        "status": plan.status,
        "usable": plan.is_usable,
        "phases": dict(plan.phases),
        "violation": dict(plan.violation),
    }


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
