"""Do plans come in time, and do their knots see every step?

The limits were measured on the planner's own model: two to four robots, every gait, rates from 1 to
200 Hz and intervals from 3 ms to 1.5 s, with and without pushes.
"""

from __future__ import annotations

from collections.abc import Iterator

from palanquin.problems.gaits import Gait
from palanquin.sim.errors import InputError
from palanquin.sim.feasibility.finding import Finding, doubt
from palanquin.sim.feasibility.walking import gaits_of
from palanquin.sim.runs.loop import number_of_ticks
from palanquin.sim.scenarios.scenario import Scenario

_FOLLOWED = 0.8
"""Share of a plan that may be followed before the next one comes: at 0.67 every gait but a pronk
still walked, at 0.9 none.
"""

_ALERT = 0.15
"""Period up to which the pushes of the paper are answered in time, s: at 0.2 s a team fell."""

_SKIPPED = 1.5
"""Interval as a multiple of the shortest stance or swing from which on none walked; from 1 on some
fell.
"""


def ticks_to_plan(scenario: Scenario) -> Iterator[Finding]:
    """The duration has at least one period, and no more than a run can hold."""
    try:
        number_of_ticks(scenario.duration, scenario.planner.period)
    except InputError as error:
        yield Finding(("duration",), str(error).removeprefix("duration: "))


def plans_in_time(scenario: Scenario) -> Iterator[Finding]:
    """The next plan comes well before the last one ends, and soon enough to answer a push."""
    planner = scenario.planner
    period, ahead = planner.period, planner.horizon * planner.dt
    rate = f"at {planner.rate:g} Hz a plan is followed for {period:.2f} s"
    if period > _FOLLOWED * ahead and period > max(_ALERT, planner.dt):
        yield Finding(
            ("planner", "rate"),
            f"{rate}, but it reaches only {ahead:.2f} s ahead ({planner.horizon} intervals of "
            f"{planner.dt:.3g} s): the team would diverge at its loose end",
        )
    elif period > _ALERT:
        yield doubt(
            ("planner", "rate"),
            f"{rate}: whatever disturbs the team in between is answered that late",
        )


def knots_in_every_step(scenario: Scenario) -> Iterator[Finding]:
    """An interval is shorter than any stance or swing, so that no plan overlooks one."""
    dt = scenario.planner.dt
    for path, gait in gaits_of(scenario):
        shortest = shortest_phase(gait)
        if dt <= shortest:
            continue
        message = (
            f"with intervals of {dt:.3g} s the planner overlooks stances and swings of gait "
            f"'{gait.name}', the shortest of which takes {shortest:.2f} s"
        )
        finding = Finding if dt > _SKIPPED * shortest else doubt
        yield finding(("planner", "dt"), f"{message} ({'.'.join(map(str, path))})")


def shortest_phase(gait: Gait) -> float:
    """The shortest stance or swing of any foot, s; the whole cycle for a foot that only stands or
    never does.
    """
    parts = [part for duty in gait.duty for part in (duty, 1 - duty) if part > 1e-9]
    return gait.period * min(parts)
