"""Planners in folders: C++ programs without Python plan the same, bit by bit."""

import subprocess
from dataclasses import replace
from enum import Enum

import numpy as np
import pytest

from palanquin import _core, pickling
from palanquin.errors import LoweringError
from palanquin.problems import clm, gaits, terrains
from palanquin.problems.foothold_courses import stepping_stones
from palanquin.problems.height_map import HeightMap
from palanquin.problems.modules import ArmTorque, LegTorque
from palanquin.problems.robots import DYNAARM, LAIKAGO
from palanquin.settings import configure
from palanquin.sim.runs.nominal import follow

PERIOD = 1 / 90
COMMAND = clm.Velocity(0.4, 0.05, 0.1)
ROUGH = np.random.default_rng(0).uniform(-0.03, 0.03, (30, 40))


def team():
    left, right = (0.0, 0.6, 0.0), (0.0, -0.6, 0.0)
    motors = LAIKAGO.motors(DYNAARM)
    carriers = (
        clm.Carrier("left", left, motors=motors),
        clm.Carrier("right", right, yaw=0.1, motors=motors),
    )
    return clm.Team(clm.Payload(), carriers)


def planner_for(terrain, ditches=(), limits=None, **options):
    problem = clm.build_clm(team(), horizon=6, terrain=terrain, ditches=len(ditches), limits=limits)
    return clm.Planner(problem, terrain, ditches, **options)


def closed_loop(planner, ticks=30, events=None):
    """The lines of a record, and the plans' trajectories; `events` come before ticks, by number."""
    state, record, plans = planner.nominal_state(), [], []
    for tick in range(ticks):
        time = tick * PERIOD
        if events and tick in events:
            record.append(events[tick](planner, time))
        measured = [time, 0.4, 0.05, 0.1, *state.bodies.ravel(), *state.feet.ravel()]
        record.append(f"plan {numbers(measured)}")
        plan = planner.solve(time, state, COMMAND)
        plans.append(plan.plan.xs)
        _, state = follow(planner, plan, state, PERIOD)
        state.bodies[:, 7:] += 0.01 * np.sin(tick + np.arange(6))  # what nobody planned
    return record, np.concatenate(plans)


def numbers(values):
    return " ".join(repr(float(value)) for value in values)


def change_gait(robot, gait):
    def event(planner, time):
        planner.clocks[robot].change(gait, time)
        return f"gait {robot} {numbers([time, gait.period, *gait.duty, *gait.offset])}"

    return event


def sense(robot, foot, has_ground):
    def event(planner, time):
        clock = planner.clocks[robot]
        before = clock.contacts(np.array([time]))[0, foot]
        clock.sense(foot, time, has_ground)
        assert before != has_ground, "the foot was to do something else"
        return f"sense {robot} {foot} {numbers([time])} {int(has_ground)}"

    return event


PLANNERS = {
    "ramp": lambda: planner_for(terrains.Ramp(1.6, 0.6, 0.5), footholds="raibert"),
    "loaded": lambda: planner_for(terrains.Flat(), team=replace(team(), feet_below="load")),
    "torques": lambda: planner_for(
        terrains.Flat(), limits={"leg_torque": LegTorque(0.3), "arm_torque": ArmTorque(0.5)}
    ),
    "observers": lambda: planner_for(
        terrains.Flat(), observers=clm.Observers(clm.Observer(9, 150, 2, 9), clm.Observer(3, 90))
    ),
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
    np.testing.assert_array_equal(plans_of_a_program(planner, record, consumer, tmp_path), plans)


def test_a_program_plans_the_same_through_changes_of_gait_and_touchdowns(consumer, tmp_path):
    planner = PLANNERS["ditches"]()
    events = {
        8: change_gait(0, gaits.crawl()),
        17: sense(1, 1, True),  # lands before its time
        24: sense(0, 1, False),  # is late
        45: change_gait(1, gaits.pace()),
    }
    record, plans = closed_loop(planner, 130, events)
    met = planner.contacts(PERIOD * np.arange(130)).reshape(130, -1)
    assert len(np.unique(met, axis=0)) > 8, "both gaits have changed"
    np.testing.assert_array_equal(plans_of_a_program(planner, record, consumer, tmp_path), plans)


def plans_of_a_program(planner, record, consumer, folder):
    planner.restart()
    saved = planner.save(folder / "planner")
    done = subprocess.run(
        [consumer.with_name("planner"), saved],
        input="\n".join(record),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return np.loadtxt(done.stdout.splitlines())


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
