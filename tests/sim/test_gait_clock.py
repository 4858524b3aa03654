"""The controllers' gait clock is the planners': the same contacts, whatever changes."""

import numpy as np
import pytest

from palanquin import _core, _sim
from palanquin.problems import gaits
from palanquin.problems.robots import A1
from palanquin.sim.scenes.quadruped import bare_quadruped
from palanquin.sim.scenes.robot_description import describe_robot

pytestmark = pytest.mark.bindings


def controller_of(gait, start):
    settings = _sim.RobotControlSettings()
    settings.gait, settings.gait_start = gait.core, start
    robot = describe_robot(bare_quadruped(A1, visual=False))
    return _sim.RobotController(robot, np.array(A1.hips), settings)


@pytest.mark.parametrize("seed", range(4))
def test_planner_and_controller_agree_on_contacts(seed):
    random = np.random.default_rng(seed)
    names = list(gaits.GAITS)
    first = gaits.by_name(str(random.choice(names)))
    planner, controller = gaits.GaitClock(first), controller_of(first, 0.0)
    for _ in range(6):
        gait = gaits.by_name(str(random.choice(names)))
        time, at_once = float(random.uniform(0, 6)), bool(random.uniform() < 0.3)
        expected = planner.change(gait, time, at_once)
        assert controller.change_gait(gait.core, time, at_once) == expected
        times = random.uniform(-0.5, 9, 200)
        flags = [[controller.stands(foot, t) for foot in range(4)] for t in times]
        np.testing.assert_array_equal(flags, planner.contacts(times))
        stances = [[controller.stance(foot, t) for foot in range(4)] for t in times]
        np.testing.assert_array_equal(stances, np.stack(planner.stances(times), axis=-1))


def test_a_robot_stands_until_its_gait_begins_and_changes_it_under_way():
    controller = controller_of(gaits.trot(), 0.3)
    assert all(controller.stands(foot, 0.29) for foot in range(4))
    assert not controller.stands(1, 0.31)
    end_of_cycle = pytest.approx(0.3 + gaits.trot().period)
    assert controller.change_gait(gaits.crawl().core, 0.4) == end_of_cycle
    three = _core.Gait("three", 0.4, [1.0] * 3, [0.0] * 3)
    with pytest.raises(ValueError, match="gait: number of duties is 3, but must be 4"):
        controller.change_gait(three, 1.0)
    with pytest.raises(ValueError, match="time is nan"):
        controller.change_gait(gaits.trot().core, float("nan"))
    for foot in (-1, 4, 10_000):
        with pytest.raises(IndexError, match=f"foot is {foot}; the gait has 4"):
            controller.stands(foot, 1.0)
