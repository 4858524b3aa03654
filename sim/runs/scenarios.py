"""Runs of scenarios: the plant and the planner that they ask for, in the loop."""

from __future__ import annotations

import math
from collections.abc import Callable

from palanquin.problems import clm, layered
from palanquin.problems.clm.team_plan import TeamState
from palanquin.problems.layered.bar_planner import BarPlanner
from palanquin.problems.layered.reference import within_circle, within_square
from palanquin.sim.errors import InputError
from palanquin.sim.runs.hands_physics import HandsPlant
from palanquin.sim.runs.loop import Loop, Tick, number_of_ticks
from palanquin.sim.runs.nominal import NominalPlant
from palanquin.sim.runs.physics import PhysicsPlant
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.reduced import ReducedPlant
from palanquin.sim.runs.teams import BarCarriers
from palanquin.sim.scenarios.bars import BarScenario
from palanquin.sim.scenarios.files import AnyScenario
from palanquin.sim.scenarios.scenario import Scenario
from palanquin.sim.scenarios.script import Director
from palanquin.sim.scenarios.team import Team

AnyPlanner = clm.Planner | layered.Planner

LEASHES = {"physics": within_circle(0.15), "reduced": within_square(0.05)}


def run_scenario(
    scenario: AnyScenario,
    planner: AnyPlanner | None = None,
    director: Director | None = None,
    progress: Callable[[int], None] = lambda ticks: None,
) -> Record:
    """Runs a scenario from its start to its end, or to a fall; see `loop_of`.

    `progress` is called after every tick with the number of ticks done.
    """
    return loop_of(scenario, planner, director).run(progress)


def loop_of(
    scenario: AnyScenario, planner: AnyPlanner | None = None, director: Director | None = None
) -> Loop:
    """A scenario's plant and planner, ready to run.

    Args:
        scenario: what to run.
        planner: from the scenario's `build_planner`, not used before; built here unless given.
        director: takes the place of the scenario's own commands.

    Raises:
        InputError: the duration has too many periods, or not a single one; the planner is of
            another kind, or its period is no multiple of a physics step.
    """
    planner = planner or scenario.build_planner()
    if isinstance(scenario, Scenario) and isinstance(planner, clm.Planner):
        return _of_hands(scenario, planner, director)
    if isinstance(scenario, BarScenario) and isinstance(planner, layered.Planner):
        return _of_bars(scenario, planner, director)
    raise InputError(f"planner: {type(planner).__name__} is not for runs of {scenario.carry}")


def _of_hands(scenario: Scenario, planner: clm.Planner, director: Director | None) -> Loop:
    start, period = scenario.start(planner), scenario.planner.period
    director, team = director or scenario.script(), scenario.scene
    if scenario.tracking != "physics":
        return nominal(planner, team, director, scenario.duration, period, start)
    most = number_of_ticks(scenario.duration, period)
    return Loop(HandsPlant(scenario, planner), planner, director, team, period, most)


def nominal(
    planner: clm.Planner,
    team: Team,
    director: Director,
    duration: float,
    period: float,
    start: TeamState | None = None,
) -> Loop:
    """A planner on its own model, from `start` or standing nominally.

    Raises InputError when duration or period (s) are not positive, or no period fits in.
    """
    most = number_of_ticks(duration, period)
    return Loop(NominalPlant(planner, period, start), planner, director, team, period, most)


def _of_bars(scenario: BarScenario, planner: layered.Planner, director: Director | None) -> Loop:
    period = planner.settings.dt
    plant: PhysicsPlant | ReducedPlant
    if scenario.tracking == "reduced":
        plant = ReducedPlant(scenario)
    else:
        plant = PhysicsPlant(scenario, period)

    def has_arrived(first: Tick, last: Tick) -> bool:
        if scenario.distance is None:
            return False
        x, start = last.seen.bodies[:, 0], first.seen.bodies[:, 0]
        return bool(x.min() - start.min() >= scenario.distance)

    return Loop(
        plant,
        BarPlanner(planner, plant, LEASHES[scenario.tracking]),
        director or scenario,
        BarCarriers(scenario.names, scenario.planner, scenario.assumed_friction),
        period,
        most=max(1, math.ceil(scenario.duration / period - 0.1)),  # a part of a period counts
        is_over=has_arrived,
    )
