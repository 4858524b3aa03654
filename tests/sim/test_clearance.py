"""Distances of the scene's shapes, against geometry by hand."""

import mujoco
import numpy as np
import pytest

from palanquin.problems.robots import quadruped
from palanquin.sim.scenarios.team import Member, Team
from palanquin.sim.scenes.scene import build_scene, joint_slice
from palanquin.sim.show.clearance import FAR, smallest_clearances
from palanquin.sim.show.kinematic import KinematicTrajectory

LAIKAGO = quadruped("laikago")
BELOW = LAIKAGO.calf_length - LAIKAGO.leg_joint("LF", "calf").offset[2]  # soles' centres of trunk
FORE = LAIKAGO.leg_joint("LF", "hip").offset[0] + LAIKAGO.leg_joint("LF", "thigh").offset[0]
UPRIGHT, UPSIDE_DOWN = (1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0)
AWAY = (0.0, -9.0, 3.0, *UPRIGHT)
WALL = (2.0, 0.0, 0.0, 1.0, 0.2, 0.0, 9.0)  # it begins at x = 1 m


@pytest.fixture(scope="module")
def scene():
    members = (Member("left", "laikago", (0, 0.6, 0)), Member("right", "laikago", (0, -0.6, 0)))
    return build_scene(Team(members, obstacles=(WALL,)))


def clearances(scene, *instants):
    """Of legs that hang straight down; an instant has the poses of some bodies, others are away."""
    qpos = np.zeros((len(instants), scene.model.nq))
    away = {"payload": (0.0, 9.0, 3.0, *UPRIGHT), "left/free": AWAY, "right/free": (9.0, *AWAY[1:])}
    for row, poses in zip(qpos, instants, strict=True):
        for joint, pose in (away | poses).items():
            row[joint_slice(scene.model, joint, 7)] = pose
    none = np.zeros((len(instants), 2))
    time = np.arange(len(instants), dtype=float)
    return smallest_clearances(KinematicTrajectory(scene, time, qpos, none, none, none), every=1)


def test_bodies_far_from_everything(scene):
    found = clearances(scene, {})
    assert {kind: least.distance for kind, least in found.items() if kind != "ground"} == {
        "obstacles": FAR,
        "robots": FAR,
        "payload": FAR,
    }


@pytest.mark.parametrize("gap", [0.3, 0.01, -0.01])
def test_soles_of_robots_meet(scene, gap):
    below = 4.0 - 2 * BELOW - 2 * LAIKAGO.foot_radius - gap
    poses = {"left/free": (0, 0, 4.0, *UPRIGHT), "right/free": (0, 0, below, *UPSIDE_DOWN)}
    least = clearances(scene, {}, poses)["robots"]
    assert least.distance == pytest.approx(gap, abs=1e-6)
    assert least.time == 1.0
    assert {least.body[:-7], least.other[:-7]} == {"left/", "right/"}
    assert {least.body[-5:], least.other[-5:]} == {"_foot"}


@pytest.mark.parametrize("gap", [0.3, 0.01, -0.01])
def test_a_robot_steps_on_the_payload(scene, gap):
    top = 4.0 - BELOW - LAIKAGO.foot_radius - gap
    poses = {"left/free": (0, 0, 4.0, *UPRIGHT), "payload": (FORE, 0, top - 0.04, *UPRIGHT)}
    least = clearances(scene, poses)["payload"]
    assert least.distance == pytest.approx(gap, abs=1e-6)
    assert least.other == "payload"


def test_the_forearm_may_touch_what_it_holds(scene):
    """The arm points straight up through the payload; at its height there is only the forearm."""
    poses = {"left/free": (0, 0, 3.0, *UPRIGHT)}
    row = np.zeros(scene.model.nq)
    row[joint_slice(scene.model, "left/free", 7)] = poses["left/free"]
    data = mujoco.MjData(scene.model)
    data.qpos[:] = row
    mujoco.mj_kinematics(scene.model, data)
    hand = data.site("left/hand").xpos
    least = clearances(scene, {**poses, "payload": (*hand, *UPRIGHT)})["payload"]
    assert 0.0 < least.distance < 0.3
    assert least.body != "left/arm_roll"


@pytest.mark.parametrize("gap", [0.5, 0.0, -0.03])
def test_the_payload_comes_to_a_wall(scene, gap):
    least = clearances(scene, {"payload": (0.96 - gap, 0, 3.0, *UPRIGHT)})["obstacles"]
    assert least.distance == pytest.approx(gap, abs=1e-6)
    assert (least.body, least.other) == ("payload", "obstacle/1")


@pytest.mark.parametrize("height", [1.3, 0.7])
def test_a_tilted_payload_comes_to_the_ground(scene, height):
    angle = 0.8
    turn = (np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0)
    least = clearances(scene, {"payload": (0, 9.0, height, *turn)})["ground"]
    corner = height - 1.0 * np.sin(angle) - 0.04 * np.cos(angle)
    assert least.distance == pytest.approx(corner, abs=1e-9)
    assert (least.body, least.other) == ("payload", "ground")
