"""Inverse kinematics by Pinocchio, against MuJoCo's forward kinematics."""

import mujoco
import numpy as np
import pytest

from palanquin.problems.robots import FEET, QUADRUPEDS
from palanquin.sim.scenes.inverse_kinematics import JOINTS, InverseKinematics
from palanquin.sim.scenes.quadruped import armed_quadruped

robots = pytest.mark.parametrize("model", QUADRUPEDS.values(), ids=QUADRUPEDS)


def random_pose(rng):
    quaternion = rng.standard_normal(4)
    return rng.standard_normal(3), quaternion / np.linalg.norm(quaternion)


def random_angles(rng, solver):
    low, high = np.maximum(solver.lower, -np.pi), np.minimum(solver.upper, np.pi)
    return rng.uniform(low, high)


@robots
def test_pinocchio_and_mujoco_agree(model):
    rng = np.random.default_rng(1)
    solver = InverseKinematics(model)
    mj = armed_quadruped(model, visual=False).compile()
    data = mujoco.MjData(mj)
    for _ in range(20):
        position, quaternion = random_pose(rng)
        angles = random_angles(rng, solver)
        data.qpos[:7] = [*position, *quaternion]
        for name, angle in zip(JOINTS, angles, strict=True):
            data.joint(name).qpos = angle
        mujoco.mj_kinematics(mj, data)
        expected = [data.site(name).xpos for name in (*FEET, "hand")]
        placed = solver.place(position, quaternion, angles)
        np.testing.assert_allclose(placed, expected, atol=1e-12)


@robots
def test_reaches_random_reachable_targets(model):
    rng = np.random.default_rng(2)
    solver = InverseKinematics(model)
    for _ in range(30):
        position, quaternion = random_pose(rng)
        targets = solver.place(position, quaternion, random_angles(rng, solver))
        solution = solver.solve(position, quaternion, targets)
        assert solution.error.max() < 1e-6
        reached = solver.place(position, quaternion, solution.angles)
        np.testing.assert_allclose(reached, targets, atol=1e-6)
        assert np.all(solution.angles >= solver.lower)
        assert np.all(solution.angles <= solver.upper)


@robots
def test_standing_knees_bend_backwards(model):
    solver = InverseKinematics(model)
    trunk, upright = np.array([0, 0, model.standing_height]), np.array([1.0, 0, 0, 0])
    feet = [(x, y, model.foot_radius) for x, y, _ in model.lumped.hips]
    targets = np.array([*feet, trunk + np.array(model.lumped.hand)])
    angles = solver.solve(trunk, upright, targets).angles
    thigh, calf = angles[1:12:3], angles[2:12:3]
    assert np.all(thigh > 0.2), "thighs point backwards"
    assert np.all(calf < -0.6), "knees behind the feet"


def test_out_of_reach_is_reported():
    model = QUADRUPEDS["laikago"]
    solver = InverseKinematics(model)
    origin, upright = np.zeros(3), np.array([1.0, 0, 0, 0])
    targets = solver.place(origin, upright, solver.middle)
    targets[0] += (0.0, 0.0, -1.0)
    solution = solver.solve(origin, upright, targets)
    reached = solver.place(origin, upright, solution.angles)
    assert 0.3 < solution.error[0] < 1.0
    assert np.linalg.norm(reached[0] - targets[0]) == pytest.approx(solution.error[0], abs=1e-9)
    assert solution.error[1:].max() < 1e-6
    assert solution.at_limit[2], "the knee is as straight as it goes"
    assert not solution.at_limit[3:12].any()


def test_roll_aligns_the_hand_and_keeps_its_place():
    model = QUADRUPEDS["laikago"]
    solver = InverseKinematics(model)
    mj = armed_quadruped(model, visual=False).compile()
    data = mujoco.MjData(mj)
    origin, upright = np.array([0, 0, 0.32]), np.array([1.0, 0, 0, 0])
    targets = solver.place(origin, upright, solver.middle)
    targets[4] += (0.0, 0.1, 0.05)
    wanted = np.array([0.3, 1.0, 0.1]) / np.linalg.norm([0.3, 1.0, 0.1])
    angles = solver.solve(origin, upright, targets, hand_y=wanted).angles

    def hand(roll):
        data.qpos[:7] = [*origin, *upright]
        for name, angle in zip(JOINTS, angles, strict=True):
            data.joint(name).qpos = angle
        data.joint("arm_roll").qpos = roll
        mujoco.mj_kinematics(mj, data)
        return data.site("hand").xpos.copy(), data.site("hand").xmat.reshape(3, 3)[:, 1].copy()

    place, axis = hand(angles[15])
    np.testing.assert_allclose(place, targets[4], atol=1e-6)
    best = max(abs(hand(roll)[1] @ wanted) for roll in np.linspace(-np.pi, np.pi, 721))
    assert abs(axis @ wanted) >= best - 1e-9
