"""Scenarios that `palanquin demo` runs: one module each, listed here."""

from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.scenario import Scenario
from palanquin.sim.scenarios.start import disturbed
from palanquin.sim.scenarios.trot import TROT

SCENARIOS = {scenario.name: scenario for scenario in (TROT,)}


def by_name(name: str) -> Scenario:
    """The scenario called `name`; raises InputError that lists the known ones."""
    if name not in SCENARIOS:
        raise InputError(f"scenario: {name!r} is not known; known are {', '.join(SCENARIOS)}")
    return SCENARIOS[name]


__all__ = ["SCENARIOS", "Scenario", "by_name", "disturbed"]
