"""What touches what: legs, arms, trunks, payload and ground."""

import mujoco
import numpy as np
import pytest

from palanquin.events import EventKind
from palanquin.sim.runs.hands_physics import held_scene
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import open_scenario
from palanquin.sim.scenarios.physical import physical
from palanquin.sim.scenes.scene import joint_slice

TROT = physical(open_scenario("trot"))
OTHERS = ["a1", "aliengo"]


def touching(scene, qpos):
    """Pairs of bodies that touch without feet on the ground."""
    model, data = scene.model, scene.data()
    data.qpos[:] = qpos
    mujoco.mj_forward(model, data)
    pairs = [sorted(model.geom_bodyid[geom] for geom in c.geom) for c in data.contact]
    return {tuple(model.body(i).name for i in pair) for pair in pairs if pair[0] > 0}


@pytest.fixture(scope="module")
def scene():
    return held_scene(TROT)


def moved(scene, joint, by):
    qpos = scene.start.copy()
    qpos[joint_slice(scene.model, joint, 3)] += by
    return qpos


@pytest.mark.parametrize("kind", ["laikago", *OTHERS])
def test_nothing_touches_at_the_start(kind):
    robots = [robot.changed(model=kind) for robot in TROT.robots]
    scene = held_scene(TROT.changed(robots=robots))
    assert touching(scene, scene.start) == set()


def test_robots_touch_each_other(scene):
    left, right = (
        scene.start[joint_slice(scene.model, f"{name}/free", 3)] for name in ("left", "right")
    )
    pairs = touching(scene, moved(scene, "left/free", right - left + [0.02, 0.01, 0]))
    touched = {(one.split("/")[-1], other.split("/")[-1]) for one, other in pairs}
    assert ("trunk", "trunk") in touched
    assert any("arm" in one and "arm" in other for one, other in touched)
    pairs = touching(scene, moved(scene, "left/free", right - left + [0.0, 0.16, 0.2]))
    assert any("calf" in one and other == "right/trunk" for one, other in pairs)


def test_the_payload_touches_robots_but_not_the_hands_that_hold_it(scene):
    low = scene.start[joint_slice(scene.model, "left/free", 3)][2]
    high = scene.start[joint_slice(scene.model, "payload", 3)][2]
    pairs = touching(scene, moved(scene, "payload", [-0.25, 0.0, low - high]))
    assert ("left/trunk", "payload") in pairs
    held = touching(scene, moved(scene, "payload", [0.02, 0.0, 0.02]))
    assert not any("arm_roll" in one or "arm_elbow" in one for one, _ in held)


def test_legs_touch_walls():
    turn = held_scene(physical(open_scenario("turn")))
    model, data = turn.model, turn.data()
    mujoco.mj_kinematics(model, data)
    x = -1.13 - data.body("left/LF_calf").xpos[0]
    data.qpos[:] = moved(turn, "left/free", [x, 0.0, 0.0])
    mujoco.mj_forward(model, data)
    on_wall = {
        model.body(max(model.geom_bodyid[c.geom[0]], model.geom_bodyid[c.geom[1]])).name
        for c in data.contact
        if any(model.geom(g).name.startswith("obstacle") for g in c.geom)
    }
    assert any("calf" in name or "thigh" in name for name in on_wall)


def test_a_run_tells_of_collisions():
    push = {"body": "left", "force": [0.0, -500.0, 0.0], "start": 0.5, "duration": 0.8}
    record = run_scenario(TROT.changed(pushes=[push], duration=2.0))
    figures = outcome(record)["collisions"]
    assert figures["steps"] > 0
    assert " touched " in figures["first"]["what"]
    assert 0.5 < figures["first"]["time_s"] < 2.0
    assert np.isfinite(record.bodies).all()
    assert sum(event.kind is EventKind.COLLISION for event in record.events) >= 1
