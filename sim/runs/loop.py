"""The closed loop, once for all: measure, plan, apply, advance."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from time import perf_counter
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from palanquin.sim.errors import InputError
from palanquin.sim.runs.record import Record, RecordBuilder, RecordedTeam
from palanquin.sim.scenarios.script import Director, Orders

Array = NDArray[np.float64]

MOST_TICKS = 50_000
"""Of a run with a payload in hands: its record takes about 12 kB a tick."""


@dataclass(frozen=True)
class Measurement:
    """What is known of a team at an instant; R robots, B bodies, feet are LF, RF, LH, RH.

    Attributes:
        time: s.
        bodies: states [B, 13]: position of the centre of mass (m), orientation (w, x, y, z; body to
            world), velocity (m/s, world), angular velocity (rad/s, body). A payload in hands is the
            first; of a team on bars there are the robots alone.
        feet: contact points [R, 4, 3], m, world.
        footholds: where the controllers will put feet that are in the air [R, 4, 3], m, world; the
            feet themselves where only the plan decides.
        ground: heights of the ground below the robots [R], m, as they know them.
    """

    time: float
    bodies: Array
    feet: Array
    footholds: Array
    ground: Array


class Plant(Protocol):
    """What moves: the planner's own model, rigid bodies on bars, or robots in full physics."""

    @property
    def time(self) -> float:
        """Now, s."""

    @property
    def fall(self) -> str:
        """Why it can't go on, in words; empty as long as it can."""

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


class Planner(Protocol):
    """Who plans, from what is measured and what is ordered."""

    @property
    def plan_time(self) -> Array:
        """Times of a plan's knots relative to the measurement [N+1], s."""

    def reference_at(self, time: float) -> Array:
        """Reference (x, y, yaw) [3] of what is led at `time`, m and rad."""

    def plan(self, seen: Measurement, orders: Orders, period: float) -> Any:
        """The plan for what is seen; never without one."""

    def row(self, plan: Any) -> dict[str, Any]:
        """A plan as fields of `Record`."""


@dataclass(frozen=True)
class Tick:
    """One period that has gone by.

    Attributes:
        seen: at its start, feet that the plan has put down included.
        plan: for it, of the planner's own kind.
        orders: that it was made for.
        values: the plant's, by name.
    """

    seen: Measurement
    plan: Any
    orders: Orders
    values: dict[str, Array]

    @property
    def time(self) -> float:
        """Of its start, s."""
        return self.seen.time


def ticks(plant: Plant, planner: Planner, director: Director, period: float) -> Iterator[Tick]:
    """Plans every `period` (s) until the plant can't go on or the director ends it."""
    while not plant.fall:
        seen = plant.measure()
        orders = director.at(seen.time, planner.reference_at(seen.time), period)
        if orders is None:
            return
        plan = planner.plan(seen, orders, period)
        seen = plant.apply(plan, seen)
        plant.advance(period, orders)
        yield Tick(seen, plan, orders, plant.values())


def run(
    plant: Plant,
    planner: Planner,
    director: Director,
    team: RecordedTeam,
    most: int,
    period: float,
    is_over: Callable[[Tick, Tick], bool] = lambda first, last: False,
    progress: Callable[[int], None] = lambda ticks: None,
) -> Record:
    """Runs until `most` ticks are done, the plant has fallen, or what is told ends it.

    A plan that is not usable is the last one, shifted by the time that has passed: the loop goes on
    with it, and its status stands in the record.

    Args:
        plant: what moves, at its start.
        planner: plans from what is measured; not used before.
        director: gives each tick's commands, gait changes and pushes.
        team: who moves, for the record.
        most: ticks, 1 or more.
        period: s between two plans; any value, the planner's knots need not match it.
        is_over: of the first and the last tick, whether the run has come to its end.
        progress: called after every tick with the number of ticks done.
    """
    builder = RecordBuilder(team, planner.plan_time)
    start, first = perf_counter(), None
    for tick in islice(ticks(plant, planner, director, period), most):
        seen, first = tick.seen, first or tick
        row = planner.row(tick.plan)
        more = {**row.pop("more"), **tick.values}
        builder.append(time=seen.time, x=seen.bodies.ravel(), feet=seen.feet, more=more, **row)
        progress(len(builder))
        if is_over(first, tick):
            break
    return builder.build(
        period=period,
        duration=plant.time,
        fall=plant.fall,
        wall=perf_counter() - start,
        extremes=plant.extremes(),
    )


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
