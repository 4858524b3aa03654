"""The scenarios that come with the package: the YAML files of this folder."""

from __future__ import annotations

from pathlib import Path

from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.files import load_scenario
from palanquin.sim.scenarios.scenario import Scenario

_FOLDER = Path(__file__).parent

SHIPPED = {path.stem: path for path in sorted(_FOLDER.glob("*.yaml"))}
"""Their files by name."""


def find_file(name: str) -> Path:
    """The file of a shipped scenario by its name, or a file by its path (.yaml, .yml, .json).

    Raises InputError for a name that is neither.
    """
    path = Path(name)
    if path.suffix in (".yaml", ".yml", ".json") or path.is_file():
        return path
    if name not in SHIPPED:
        raise InputError(f"scenario: {name!r} is not known; known are {', '.join(SHIPPED)}")
    return SHIPPED[name]


def open_scenario(name: str) -> Scenario:
    """The scenario of `find_file`; raises InputError, or ScenarioError for a file with faults."""
    return load_scenario(find_file(name))
