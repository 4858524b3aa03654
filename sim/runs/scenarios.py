"""Runs of scenarios: the plant and the planner that they ask for, in the loop."""

from __future__ import annotations

import math
from collections.abc import Callable

from palanquin.problems.clm.planner import Planner
from palanquin.problems.clm.team_plan import TeamState
from palanquin.problems.layered.planner import Planner as LayeredPlanner
from palanquin.sim.runs import loop
from palanquin.sim.runs.bar_planner import BarPlanner
from palanquin.sim.runs.bar_reference import within_circle
from palanquin.sim.runs.nominal import NominalPlant
from palanquin.sim.runs.payload_planner import PayloadPlanner
from palanquin.sim.runs.physics import PhysicsPlant
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.teams import BarCarriers
from palanquin.sim.scenarios.bar_planners import build_planner
from palanquin.sim.scenarios.bars import BarScenario
from palanquin.sim.scenarios.scenario import Scenario
from palanquin.sim.scenarios.script import Director
from palanquin.sim.team import Team

LEASH = within_circle(0.15)


def run_scenario(
    scenario: Scenario,
    planner: Planner | None = None,
    progress: Callable[[int], None] = lambda ticks: None,
) -> Record:
    """Runs a scenario of carrying hands from its start for its duration, on the planner's model.

    Args:
        scenario: what to run.
        planner: from `scenario.build_planner`, not used before; built here unless given.
        progress: called after every tick with the number of ticks done.

    Raises:
        InputError: the duration has too many periods, or not a single one.
    """
    planner = planner or scenario.build_planner()
    start, period = scenario.start(planner), scenario.planner.period
    director, team = scenario.script(), scenario.scene
    return run_nominal(planner, team, director, scenario.duration, period, start, progress)


def run_nominal(
    planner: Planner,
    team: Team,
    director: Director,
    duration: float,
    period: float,
    start: TeamState | None = None,
    progress: Callable[[int], None] = lambda ticks: None,
) -> Record:
    """Runs a planner on its own model, from `start` or standing nominally; see `loop.run`.

    Raises InputError when duration or period (s) are not positive, or no period fits in.
    """
    most = loop.number_of_ticks(duration, period)
    plant, leading = nominal(planner, period, start)
    return loop.run(plant, leading, director, team, most, period, progress=progress)


def nominal(
    planner: Planner, period: float, start: TeamState | None = None
) -> tuple[NominalPlant, PayloadPlanner]:
    """The planner's own model, and the planner, as the loop takes them."""
    return NominalPlant(planner, period, start), PayloadPlanner(planner)


def run_bars(
    scenario: BarScenario,
    planner: LayeredPlanner | None = None,
    director: Director | None = None,
    progress: Callable[[int], None] = lambda ticks: None,
) -> Record:
    """Runs robots on bars in physics, to the end of the duration or the distance, or to a fall.

    Args:
        scenario: what to run.
        planner: from `build_planner`, not used before; built here unless given.
        director: takes the place of the scenario's own commands.
        progress: called after every tick with the number of ticks done.

    Raises:
        InputError: the planner's period is no multiple of a physics step.
    """
    planner = planner or build_planner(scenario)
    plant, leading = physics(scenario, planner)
    period = planner.settings.dt
    carriers = BarCarriers(scenario.team.names, scenario.planner, scenario.assumed_friction)

    def has_arrived(first: loop.Tick, last: loop.Tick) -> bool:
        x, start = last.seen.bodies[:, 0], first.seen.bodies[:, 0]
        return bool(x.min() - start.min() >= (scenario.distance or math.inf))

    return loop.run(
        plant, leading, director or scenario, carriers, ticks_of(scenario, period), period,
        has_arrived, progress,
    )  # fmt: skip


def ticks_of(scenario: BarScenario, period: float) -> int:
    """How many plans a run has at most, one for a part of a `period` (s) too."""
    return max(1, math.ceil(scenario.duration / period - 0.1))


def physics(scenario: BarScenario, planner: LayeredPlanner) -> tuple[PhysicsPlant, BarPlanner]:
    """The scene at its start, and the planner, as the loop takes them."""
    plant = PhysicsPlant(scenario, planner.settings.dt)
    return plant, BarPlanner(planner, plant.contacts, LEASH)
