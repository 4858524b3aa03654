"""Scenarios: runs as data. Files are read by `open_scenario`; `Scenario` is what they hold."""

from palanquin.sim.scenarios.files import ScenarioError, ScenarioFile, load_scenario
from palanquin.sim.scenarios.library import SHIPPED, find_file, open_scenario
from palanquin.sim.scenarios.lineup import with_robots
from palanquin.sim.scenarios.scenario import Scenario
from palanquin.sim.scenarios.start import disturbed

__all__ = [
    "SHIPPED",
    "Scenario",
    "ScenarioError",
    "ScenarioFile",
    "disturbed",
    "find_file",
    "load_scenario",
    "open_scenario",
    "with_robots",
]
