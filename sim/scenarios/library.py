"""The scenarios that come with the package: the YAML files of this folder."""

from __future__ import annotations

from pathlib import Path

from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.files import AnyScenario, load_scenario
from palanquin.sim.scenarios.scenario import Scenario

_FOLDER = Path(__file__).parent

SHIPPED = {path.stem: path for path in sorted(_FOLDER.glob("*.yaml"))}
"""Files of runs of carrying hands by name."""

BARS = {path.stem: path for path in sorted((_FOLDER / "on_bars").glob("*.yaml"))}
"""Files of runs on bars by name."""

SUITES = _FOLDER / "suites"
"""A folder for each suite of a campaign, of scenarios that its seeds take in turns."""


def find_file(name: str) -> Path:
    """The file of a shipped scenario by its name, or a file by its path (.yaml, .yml, .json).

    Raises InputError for a name that is neither.
    """
    path = Path(name)
    if path.suffix in (".yaml", ".yml", ".json") or path.is_file():
        return path
    known = SHIPPED | BARS
    if name not in known:
        raise InputError(f"scenario: {name!r} is not known; known are {', '.join(known)}")
    return known[name]


def open_any(name: str) -> AnyScenario:
    """The scenario of `find_file`, whatever carries; raises as `open_scenario`."""
    return load_scenario(find_file(name))


def open_scenario(name: str) -> Scenario:
    """The scenario of `find_file`, of carrying hands; raises InputError, or ScenarioError for a
    file with faults.
    """
    scenario = open_any(name)
    if not isinstance(scenario, Scenario):
        raise InputError(f"{name}: carry: is 'bars'; only runs of carrying hands can do this")
    return scenario
