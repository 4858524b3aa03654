"""The problems that `palanquin check` is asked about, with the knots to look at."""

from __future__ import annotations

import runpy
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from palanquin.errors import ProblemError
from palanquin.lowered import Lowered, load
from palanquin.problem import Problem

if TYPE_CHECKING:
    from palanquin.problems.layered.planner import Planner as LayeredPlanner

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Subject:
    """A problem with parameters [N + 1, np] and the knots [N + 1, nz] of a start; None for the
    neutral knot.
    """

    lowered: Lowered
    parameters: Array | None = None
    trajectory: Array | None = None


def subjects(source: str) -> Iterator[Subject]:
    """The problems behind a word on the command line.

    Raises:
        ProblemError: there is none, or it cannot be read; other errors of what it names.
    """
    from palanquin.problems.collection import COLLECTION

    path = Path(source)
    file, _, name = source.rpartition(":")
    if file.endswith(".py"):
        yield Subject(_own(Path(file), name).lower())
    elif path.suffix == ".py":
        raise ProblemError(f"{source}: which problem? {source}:NAME is needed")
    elif path.is_dir():
        yield Subject(load(path))
    elif source in COLLECTION:
        yield _of_collection(source)
    else:
        yield from _of_file(path) if path.is_file() else _of_scenario(source)


def _of_collection(name: str) -> Subject:
    from palanquin.problems.collection import COLLECTION

    lowered = COLLECTION[name].build().lower()
    parameters, _, guess = COLLECTION[name].starts(lowered)["random 0"]
    return Subject(lowered, parameters.values, guess.values)


def _of_file(path: Path) -> Iterator[Subject]:
    from palanquin.dump import is_dump, read_dump
    from palanquin.problems.case_files import read_case
    from palanquin.problems.layered.case import is_layered

    if is_dump(path):
        instance = read_dump(path).instance()
        yield Subject(instance.lowered, instance.parameters, instance.guess)
    elif path.suffix != ".json":
        yield from _of_scenario(str(path))
    else:
        data = read_case(path)
        yield from _of_layered_case(data, str(path)) if is_layered(data) else _of_case(data, path)


def _of_case(data: Any, path: Path) -> Iterator[Subject]:
    from palanquin.problems.clm import parse_case
    from palanquin.problems.clm.case_problem import CaseProblem

    case = parse_case(data, str(path))
    converted = CaseProblem.of(case)
    lowered = converted.build().lower()
    parameters, guess = lowered.parameters(case.N), lowered.trajectory(case.N)
    converted.fill_parameters(parameters)
    converted.fill_guess(guess)
    yield Subject(lowered, parameters.values, guess.values)


def _of_layered_case(data: Any, source: str) -> Iterator[Subject]:
    from palanquin.problems.layered.case import parse_layered_case
    from palanquin.problems.layered.solve import plan_case, planners_of

    case = parse_layered_case(data, source)
    for planner in planners_of(case).values():
        plan_case(planner, case)
        yield from _of_planner(planner)


def _of_planner(planner: LayeredPlanner) -> Iterator[Subject]:
    """The problems of robots on a bar, where the last plan left them."""
    for mpc in planner.problems:
        yield Subject(mpc.lowered, mpc.params.values, mpc.sqp.latest)


def _of_scenario(name: str) -> Iterator[Subject]:
    """What the planner of a scenario solves first."""
    from palanquin.sim.runs.loop import take_orders
    from palanquin.sim.scenarios import open_scenario

    scenario = open_scenario(name)
    planner = scenario.build_planner()
    state = scenario.start(planner)
    orders = scenario.script().at(0.0, planner.reference, scenario.planner.period)
    take_orders(planner, orders, 0.0, scenario.scene)
    plan = planner.solve(0.0, state, orders.velocity)
    yield Subject(planner.lowered, planner.params.values, plan.plan.xs)


def _own(path: Path, name: str) -> Problem:
    """The problem that a Python file holds under a name, or that a function of it makes."""
    if not path.is_file():
        raise ProblemError(f"{path}: there is no such file")
    names = runpy.run_path(str(path))
    if name not in names:
        raise ProblemError(f"{path} has no '{name}'")
    found: Problem | Callable[[], Problem] = names[name]
    made = found() if callable(found) else found
    if not isinstance(made, Problem):
        raise ProblemError(f"{path}:{name} is {type(made).__name__}; a Problem is needed")
    return made
