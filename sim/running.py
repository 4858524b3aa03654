"""Runs of scenarios in closed loop on the planner's own model."""

from __future__ import annotations

from collections.abc import Callable

from palanquin.problems.clm.planner import Planner
from palanquin.sim import closed_loop
from palanquin.sim.rollout import Rollout
from palanquin.sim.scenarios.scenario import Scenario


def run_scenario(
    scenario: Scenario,
    planner: Planner | None = None,
    progress: Callable[[int], None] = lambda ticks: None,
) -> Rollout:
    """Runs a scenario from its start for its duration.

    Args:
        scenario: what to run.
        planner: from `scenario.build_planner`, not used before; built here unless given.
        progress: called after every tick with the number of ticks done.

    Raises:
        InputError: the duration has too many periods, or not a single one.
    """
    planner = planner or scenario.build_planner()
    return closed_loop.run(
        planner,
        scenario.scene,
        scenario.script(),
        scenario.duration,
        scenario.planner.period,
        scenario.start(planner),
        progress,
    )
