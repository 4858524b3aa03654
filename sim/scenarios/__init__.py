"""Scenarios: runs as data. Files are read by `open_scenario`; `Scenario` is what they hold."""

from palanquin.sim.scenarios.bars import BarScenario
from palanquin.sim.scenarios.files import (
    AnyScenario,
    ScenarioError,
    ScenarioFile,
    load_scenario,
    schemas,
)
from palanquin.sim.scenarios.library import BARS, SHIPPED, find_file, open_any, open_scenario
from palanquin.sim.scenarios.lineup import with_robots
from palanquin.sim.scenarios.scenario import Scenario
from palanquin.sim.scenarios.start import disturbed

__all__ = [
    "BARS",
    "SHIPPED",
    "AnyScenario",
    "BarScenario",
    "Scenario",
    "ScenarioError",
    "ScenarioFile",
    "disturbed",
    "find_file",
    "load_scenario",
    "open_any",
    "open_scenario",
    "schemas",
    "with_robots",
]
