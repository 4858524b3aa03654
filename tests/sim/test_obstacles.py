"""Obstacles in scenarios: what they are, how they look, and that nothing touches them."""

import re

import mujoco
import numpy as np
import pytest

from palanquin.sim.errors import InputError
from palanquin.sim.feasibility.obstacles import obstacles_beside_the_way
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import open_scenario
from palanquin.sim.scenarios.team import Team
from palanquin.sim.scenes.scene import build_scene
from palanquin.sim.show.clearance import smallest_clearances
from palanquin.sim.show.kinematic import track

TROT = open_scenario("trot")


def test_walls_and_cylinders_are_where_they_should_be():
    wall = {"type": "wall", "start": [1.0, 0.0], "end": [1.0, 2.0], "thickness": 0.2, "top": 0.7}
    cylinder = {"type": "cylinder", "centre": [-1.0, 0.5], "radius": 0.3}
    scene = build_scene(TROT.changed(obstacles=[wall, cylinder]).scene)
    data = mujoco.MjData(scene.model)
    mujoco.mj_forward(scene.model, data)

    def hit(start, direction):
        geom = np.zeros(1, np.int32)
        groups = np.array([1, 1, 1, 0, 0, 0], np.uint8)
        distance = mujoco.mj_ray(scene.model, data, start, direction, groups, 1, -1, geom)
        return distance, scene.model.geom(geom[0]).name

    assert hit([2.0, 1.5, 0.5], [-1.0, 0.0, 0.0]) == (pytest.approx(0.9), "obstacle/1")
    assert hit([1.0, 1.9, 2.0], [0.0, 0.0, -1.0]) == (pytest.approx(1.3), "obstacle/1")
    assert hit([-2.0, 0.5, 0.3], [1.0, 0.0, 0.0]) == (pytest.approx(0.7), "obstacle/2")


def test_a_recorded_team_keeps_its_obstacles():
    team = open_scenario("turn").scene
    assert Team.from_json(team.to_json()) == team
    assert len(team.obstacles) == 3


def test_start_poses_are_drawn_within_their_spread():
    scenario = open_scenario("turn")
    poses = np.array([scenario.start_pose.draw(seed) for seed in range(30)])
    stated = [scenario.start_pose.x, scenario.start_pose.y, scenario.start_pose.yaw]
    np.testing.assert_array_equal(poses[0], stated)
    assert (np.abs(poses - stated) <= scenario.start_pose.spread).all()
    assert len(np.unique(poses, axis=0)) == 30


def test_nothing_touches_a_wall_beside_the_way():
    """The team is told to walk along a wall into which its beam would reach."""
    wall = {"type": "wall", "start": [0.5, 1.0], "end": [3.0, 0.85], "thickness": 0.1}
    scenario = TROT.changed(obstacles=[wall], duration=2.5)
    rollout = run_scenario(scenario)
    clearance = smallest_clearances(track(rollout, frame_rate=10.0), every=1)["obstacles"]
    assert 0.0 < clearance.distance < 0.1
    assert clearance.body == "payload"
    assert rollout.x[-1, 1] < -0.05  # it gave way


@pytest.mark.parametrize(
    ("obstacle", "message"),
    [
        ({"type": "box", "centre": [0, 0], "size": [1, 0]}, "size"),
        ({"type": "wall", "start": [1, 1], "end": [1, 1]}, "a wall needs a length"),
        ({"type": "cylinder", "centre": [0, 0]}, "radius"),
        ({"type": "cone", "centre": [0, 0]}, "cone"),
        ({"type": "box", "centre": [0, float("nan")], "size": [1, 1]}, "centre"),
    ],
)
def test_bad_obstacles_say_what_is_wrong(obstacle, message):
    with pytest.raises(InputError, match=message):
        TROT.changed(obstacles=[obstacle])


@pytest.mark.parametrize(
    ("obstacle", "is_error", "message"),
    [
        ({"type": "cylinder", "centre": [0.0, 1.05], "radius": 0.1}, True, "begins 11 cm inside"),
        ({"type": "box", "centre": [2.0, 0.0], "size": [0.2, 0.2]}, False, "leads .* into it"),
        ({"type": "box", "centre": [-0.38, 0.6], "size": [0.1, 0.1]}, True, "begins"),
    ],
)
def test_a_way_through_an_obstacle_is_found(obstacle, is_error, message):
    (finding,) = obstacles_beside_the_way(TROT.changed(obstacles=[obstacle]))
    assert finding.path == ("obstacles", 0)
    assert finding.is_error == is_error
    assert re.search(message, finding.message)


def test_obstacles_beside_the_way_are_fine():
    beside = {"type": "wall", "start": [-3.0, 1.4], "end": [9.0, 1.4]}
    assert not list(obstacles_beside_the_way(TROT.changed(obstacles=[beside])))
    assert not list(obstacles_beside_the_way(open_scenario("turn")))
    assert not list(obstacles_beside_the_way(TROT))
