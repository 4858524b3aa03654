"""What is run: the scenarios of section IV, and what each of them must show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from palanquin.benchmarks.clm_paper.criteria import ALWAYS, CROSSING, HELD, REACH, Criterion
from palanquin.benchmarks.clm_paper.figures_of_runs import (
    Row,
    deepest_foothold,
    is_across,
    payload_shift,
    steepest_lean,
    step_towards_payload,
)
from palanquin.problems.modules.weights import TABLE_I
from palanquin.sim.runs.record import Record
from palanquin.sim.scenarios import Scenario, open_scenario

Measure = Callable[[Scenario, Record], Row]


@dataclass(frozen=True)
class Experiment:
    """A scenario that is run from several seeds.

    Attributes:
        name: key of its rows and part of its files' names.
        title: for the report.
        scenario: what is run, with the seed still to be chosen.
        measure: figures of a run beyond those that every run has.
        criteria: what each run must show; empty for a run that is there to be compared with.
        seeds: how many runs at most; all that were asked for unless told.
    """

    name: str
    title: str
    scenario: Scenario
    measure: Measure
    criteria: tuple[Criterion, ...] = ()
    seeds: int | None = None

    def __post_init__(self) -> None:
        if self.seeds is not None and self.seeds < 1:
            raise ValueError(f"experiment {self.name}: seeds {self.seeds} must be at least 1")


PRINTED_WEIGHTS = {name: tuple(getattr(TABLE_I, name)) for name in ("force", "torque")}
"""Table I's, which the scenarios' own differ from; the others are the same."""


def planned(scenario: Scenario, **settings: Any) -> Scenario:
    """The scenario with other settings of its planner."""
    return scenario.changed(planner={**dict(scenario.planner), **settings})


OTHER_GAITS = {"pace": 0.4, "pronk": 0.4, "bound": 0.3, "crawl": 0.15}
"""In which ditches are crossed too, and how fast, m/s."""

COURSE = 7.2
"""How far the payload goes, m: until the hind feet are past the last ditch."""

OTHER_SEEDS = 5
"""How many courses in each of them."""


def paper_experiments() -> tuple[Experiment, ...]:
    """Push, ditches, ramp up and down; with the paper's own settings where ours differ."""
    push, ditch = open_scenario("push"), open_scenario("ditch")
    return (
        Experiment(
            "push",
            "A push of 164 N for 0.8 s",
            push,
            _measure_push,
            HELD,
        ),
        Experiment(
            "push-printed",
            "The push with Table I's weights of forces and hand torques",
            planned(push, weights=PRINTED_WEIGHTS),
            _measure_push,
            seeds=1,
        ),
        Experiment("ditch", "12 random ditches up to 32 cm wide", ditch, _measure_ditch, CROSSING),
        *(_in_gait(ditch, gait, speed) for gait, speed in OTHER_GAITS.items()),
        *_ramps("ramp", "The ramp of 38.7 degrees, climbed"),
        *_ramps("ramp-down", "The ramp, descended"),
    )


def _in_gait(ditch: Scenario, gait: str, speed: float) -> Experiment:
    """The courses of ditches in another gait, as far as in the scenario's own."""
    scenario = ditch.changed(
        robots=[{**dict(robot), "gait": gait} for robot in ditch.robots],
        command={"type": "velocity", "steps": [{"vx": speed}]},
        duration=COURSE / speed,
    )
    return Experiment(
        f"ditch-{gait}",
        f"The same, {gait} at {speed:g} m/s",
        scenario,
        _measure_ditch,
        CROSSING,
        OTHER_SEEDS,
    )


def _ramps(name: str, title: str) -> tuple[Experiment, ...]:
    """Our references, and the paper's once: with our weights and stiffness, and with Table I's."""
    scenario = open_scenario(name)
    papers = planned(scenario, references="rigid", footholds="hips")
    printed = {family: {"stiffness": 42.0, "smoothing": 1e-4} for family in ("leg", "arm")}
    return (
        Experiment(name, title, scenario, _nothing_more, (*ALWAYS, REACH)),
        Experiment(
            f"{name}-rigid", f"{title}, the paper's references", papers, _nothing_more, seeds=1
        ),
        Experiment(
            f"{name}-printed",
            f"{title}, the paper's references, Table I's K of legs and arms and weights of forces",
            planned(papers, penalties=printed, weights=PRINTED_WEIGHTS),
            _nothing_more,
            seeds=1,
        ),
    )


def _measure_push(scenario: Scenario, rollout: Record) -> Row:
    since = scenario.pushes[0].start
    return {
        "payload_shift_m": payload_shift(rollout, since),
        "lean_deg": steepest_lean(rollout),
        "step_towards_payload_m": step_towards_payload(rollout, since, robot=1),
    }


def _measure_ditch(scenario: Scenario, rollout: Record) -> Row:
    lines = scenario.ditches.draw(scenario.seed)
    return {
        "deepest_foothold_m": deepest_foothold(rollout, lines),
        "is_across": is_across(rollout, lines),
    }


def _nothing_more(scenario: Scenario, rollout: Record) -> Row:
    return {}
