"""The layered paper's scenarios, the files of `scenarios/`, and how they are run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from palanquin.problems.layered import VARIANTS, Planner
from palanquin.sim.runs.loop import Loop
from palanquin.sim.runs.scenarios import loop_of
from palanquin.sim.scenarios import BarScenario, load_scenario
from palanquin.sim.scenarios.bar_planners import KINDS, interconnected

_FOLDER = Path(__file__).parent / "scenarios"


def scenarios_of(folder: Path) -> dict[str, BarScenario]:
    """The runs on bars of a folder, by the names of their files."""
    found = {path.stem: load_scenario(path) for path in sorted(folder.glob("*.yaml"))}
    return {name: scenario for name, scenario in found.items() if isinstance(scenario, BarScenario)}


PHYSICS = scenarios_of(_FOLDER)
"""In full physics; each is run with the planners that a figure asks for."""

REDUCED = scenarios_of(_FOLDER / "reduced")
"""On the reduced-order plant; each is run with any planner and both sets of weights."""


def reduced_planner(scenario: BarScenario, planner: str, weights: str, **options: Any) -> Planner:
    """A planner, one of `KINDS`, of a run on the reduced-order plant with one of `VARIANTS`."""
    return KINDS[planner](interconnected(scenario.team), VARIANTS[weights], **options)


def reduced_loop(
    name: str, duration: float, planner: str = "distributed", weights: str = "working",
    **options: Any,
) -> Loop:  # fmt: skip
    """A run of `duration` (s) of one of `REDUCED`; options are the planner's."""
    scenario = REDUCED[name].changed(duration=duration)
    return loop_of(scenario, reduced_planner(scenario, planner, weights, **options))
