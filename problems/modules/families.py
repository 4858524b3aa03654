"""Families of inequalities of team problems, each registered once beside its rows.

What a family registers is all that builder, scenario files, their documents and a run's figures
know of it: its unit, how it enters a problem, and, if it is an option, its limits. A new one takes
a file with its rows and its registration, and the line of this package's `__init__` that imports
it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palanquin.errors import ProblemError
from palanquin.policies import Penalty
from palanquin.problem import Problem


@dataclass(frozen=True)
class Family:
    """A family of inequalities.

    Attributes:
        name: of its rows.
        policy: how it enters unless told otherwise.
        unit: that its rows count in, m or N: `FORCE_UNIT` of those of forces.
        option: what the builder's `limits` and a scenario's planner settings call it; empty for a
            family that a module of its own adds.
        limits: dataclass of an option's limits, each field made by `limit`; run-time parameters.
        add: adds an option's rows to a team problem.
        meaning: of the option, for documents.
    """

    name: str
    policy: Penalty
    unit: float = 1.0
    option: str = ""
    limits: type[Any] | None = None
    add: Callable[[Problem, Any], None] | None = None
    meaning: str = ""


FAMILIES: dict[str, Family] = {}
"""All that are registered, by name."""


def register(family: Family) -> Family:
    """Makes a family known; raises ProblemError for a name or an option that is taken."""
    if family.name in FAMILIES or (family.option and family.option in options()):
        raise ProblemError(f"the family '{family.name}' or its option is registered already")
    FAMILIES[family.name] = family
    return family


def options() -> dict[str, Family]:
    """Families that are options, by what options are called."""
    return {family.option: family for family in FAMILIES.values() if family.option}


def unit_of(family: str) -> float:
    """Of a family's rows, m or N; 1 for one of an own problem."""
    return FAMILIES[family].unit if family in FAMILIES else 1.0


def limit(default: float, meaning: str) -> Any:
    """A field of an option's limits, with its meaning and unit for documents."""
    return field(default=default, metadata={"description": meaning})


def add_options(problem: Problem, limits: Mapping[str, Any]) -> None:
    """Adds the rows of options to a problem with a team, by option and limits.

    Raises ProblemError for an option that is not there, or limits of another one.
    """
    known = options()
    for option, values in limits.items():
        if option not in known:
            raise ProblemError(f"limits: {option!r} is not known; there are {', '.join(known)}")
        family = known[option]
        if not isinstance(values, family.limits or ()) or family.add is None:
            wanted = family.limits.__name__ if family.limits else "nothing"
            raise ProblemError(f"limits: {option} is {values!r}; {wanted} is needed")
        family.add(problem, values)


def values_of(limits: Any) -> list[float]:
    """Limits as the values of a run-time parameter, in the order of their fields."""
    return [float(value) for value in np.ravel(list(vars(limits).values()))]
