"""Planners in folders: C++ programs without Python plan the same, bit by bit."""

import subprocess
from dataclasses import replace
from enum import Enum

import numpy as np
import pytest

from palanquin import _core, pickling
from palanquin.errors import LoweringError
from palanquin.problems import clm, terrains
from palanquin.problems.foothold_courses import stepping_stones
from palanquin.problems.height_map import HeightMap
from palanquin.settings import configure
from palanquin.sim.runs.nominal import follow

PERIOD = 1 / 90
COMMAND = clm.Velocity(0.4, 0.05, 0.1)
ROUGH = np.random.default_rng(0).uniform(-0.03, 0.03, (30, 40))


def team():
    left, right = (0.0, 0.6, 0.0), (0.0, -0.6, 0.0)
    carriers = (clm.Carrier("left", left), clm.Carrier("right", right, yaw=0.1))
    return clm.Team(clm.Payload(), carriers)


def planner_for(terrain, ditches=(), **options):
    problem = clm.build_clm(team(), horizon=6, terrain=terrain, ditches=len(ditches))
    return clm.Planner(problem, terrain, ditches, **options)


def closed_loop(planner, ticks=30):
    """What was measured, and the plans' trajectories."""
    state, record, plans = planner.nominal_state(), [], []
    for tick in range(ticks):
        time = tick * PERIOD
        record.append([time, 0.4, 0.05, 0.1, *state.bodies.ravel(), *state.feet.ravel()])
        plan = planner.solve(time, state, COMMAND)
        plans.append(plan.plan.xs)
        _, state = follow(planner, plan, state, PERIOD)
    return np.array(record), np.concatenate(plans)


PLANNERS = {
    "ramp": lambda: planner_for(terrains.Ramp(1.6, 0.6, 0.5), footholds="raibert"),
    "loaded": lambda: planner_for(terrains.Flat(), team=replace(team(), feet_below="load")),
    "ditches": lambda: planner_for(
        terrains.Flat(0.1), [[1.0, 0.0, -0.6, 0.15], [1.0, 0.1, -1.1, 0.1]], candidates=2
    ),
    "map": lambda: planner_for(HeightMap(ROUGH, (-1.0, -1.0), 0.1)),
    "stones": lambda: planner_for(stepping_stones(1, length=1.0, start=0.4, width=2.4)),
    "formula": lambda: planner_for(
        terrains.Formula(lambda x, y: 0.05 * x**2 / (1 + x**2)), max_iterations=2
    ),
}


@pytest.mark.parametrize("kind", PLANNERS)
def test_a_program_without_python_plans_the_same(kind, consumer, tmp_path):
    planner = PLANNERS[kind]()
    record, plans = closed_loop(planner)
    planner.restart()
    folder = planner.save(tmp_path / "planner")
    lines = "\n".join(" ".join(map(repr, row)) for row in record.tolist())
    done = subprocess.run(
        [consumer.with_name("planner"), folder], input=lines, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    np.testing.assert_array_equal(np.loadtxt(done.stdout.splitlines()), plans)


def test_a_planner_is_saved_as_it_was_built(tmp_path):
    planner = PLANNERS["ditches"]()
    fresh = (planner.save(tmp_path / "fresh") / "planner").read_text()
    closed_loop(planner, ticks=3)
    planner.restart()
    planner.save(tmp_path / "fresh")
    assert (tmp_path / "fresh" / "planner").read_text() == fresh


def test_all_settings_are_saved():
    settings = configure(_core.SqpSettings(), max_iterations=7, qp="ldl", globalize=False)
    lines = _core.sqp_settings_text(settings).splitlines()
    written = dict(line.removeprefix("setting ").split() for line in lines)
    fields = dict(numbers_of(settings))
    assert written.keys() == fields.keys()
    for name, value in fields.items():
        assert type(value)(written[name]) == value, name


def numbers_of(settings, prefix=""):
    """Every field of a struct of settings and of those in it, by its dotted name."""
    for name in pickling.fields(settings):
        value = getattr(settings, name)
        if isinstance(value, Enum | bool):
            yield prefix + name, int(value.value if isinstance(value, Enum) else value)
        elif isinstance(value, str | int | float):
            yield prefix + name, value
        else:
            yield from numbers_of(value, f"{prefix}{name}.")


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(LoweringError, match="file"):
        PLANNERS["ramp"]().save(tmp_path / "file")
