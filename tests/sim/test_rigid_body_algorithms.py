"""Pinocchio's mass matrix, bias and Jacobians against MuJoCo's, for the robots as we build them."""

import mujoco
import numpy as np
import pytest

from palanquin._sim import BodyDescription, RobotDescription, RobotModel, RobotState
from palanquin.problems.robots import A1, LAIKAGO
from palanquin.sim.scenes.quadruped import armed_quadruped, bare_quadruped
from palanquin.sim.scenes.robot_description import describe_robot

pytestmark = pytest.mark.bindings

ROBOTS = {
    "a1": lambda: bare_quadruped(A1, visual=False),
    "armed laikago": lambda: armed_quadruped(LAIKAGO, visual=False),
}


def hat(a):
    return np.cross(np.eye(3), a)


def state_of(data: mujoco.MjData) -> RobotState:
    state = RobotState()
    state.base_position, state.base_orientation = data.qpos[:3], data.qpos[3:7]
    state.joint_positions = data.qpos[7:]
    state.base_velocity, state.base_rate = data.qvel[:3], data.qvel[3:6]
    state.joint_velocities = data.qvel[6:]
    return state


@pytest.fixture(params=ROBOTS.values(), ids=ROBOTS)
def pair(request):
    """The same robot in the same random state, in MuJoCo and in Pinocchio, and T with
    v_pinocchio = T v_mujoco (the base's linear velocity turned into body axes) and dT/dt.
    """
    spec = request.param()
    robot, model = RobotModel(describe_robot(spec)), spec.compile()
    data, random = mujoco.MjData(model), np.random.default_rng(1)
    data.qpos[:], data.qvel[:] = random.normal(size=model.nq), random.normal(size=model.nv)
    data.qpos[3:7] /= np.linalg.norm(data.qpos[3:7])
    mujoco.mj_forward(model, data)
    robot.update(state_of(data))
    rotation = data.xmat[1].reshape(3, 3)
    turn, turn_rate = np.eye(model.nv), np.zeros((model.nv, model.nv))
    turn[:3, :3], turn_rate[:3, :3] = rotation.T, -hat(data.qvel[3:6]) @ rotation.T
    return model, data, robot, turn, turn_rate


def test_mass_matrices_agree(pair):
    model, data, robot, turn, _ = pair
    expected = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, expected)
    np.testing.assert_allclose(turn.T @ robot.mass_matrix @ turn, expected, atol=1e-12)
    assert robot.mass == pytest.approx(model.body_mass.sum(), rel=1e-12)


def test_biases_agree(pair):
    model, data, robot, turn, turn_rate = pair
    bias = turn.T @ (robot.bias + robot.mass_matrix @ turn_rate @ data.qvel)
    expected = data.qfrc_bias + model.dof_damping * data.qvel
    np.testing.assert_allclose(bias, expected, atol=1e-11)


def test_limbs_move_alike(pair):
    model, data, robot, turn, _ = pair
    for site in range(model.nsite):
        jacobian, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacSite(model, data, jacobian, angular, site)
        point = robot.limb(site)
        np.testing.assert_allclose(point.jacobian @ turn, jacobian, atol=1e-12)
        np.testing.assert_allclose(point.angular_jacobian @ turn, angular, atol=1e-12)
        np.testing.assert_allclose(point.rotation.ravel(), data.site_xmat[site], atol=1e-12)
        np.testing.assert_allclose(point.rate, angular @ data.qvel, atol=1e-12)
        np.testing.assert_allclose(point.position, data.site_xpos[site], atol=1e-12)
        np.testing.assert_allclose(point.velocity, jacobian @ data.qvel, atol=1e-12)


def test_centre_of_mass_moves_alike(pair):
    model, data, robot, turn, _ = pair
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jacSubtreeCom(model, data, jacobian, 1)
    np.testing.assert_allclose(robot.com.jacobian @ turn, jacobian, atol=1e-12)
    np.testing.assert_allclose(robot.com.position, data.subtree_com[1], atol=1e-12)


def test_drifts_are_the_derivatives_of_velocities_without_acceleration(pair):
    """p'' with v' = 0 against a difference of velocities along that motion."""
    model, data, robot, _, _ = pair
    points = [robot.com, *(robot.limb(i) for i in range(model.nsite))]
    drifts = [np.array(point.drift) for point in points]
    v, dt, velocities = np.array(robot.velocity), 1e-6, []
    for side in (-1, 1):
        moved = mujoco.MjData(model)
        moved.qpos[:], moved.qvel[:] = data.qpos, data.qvel
        mujoco.mj_integratePos(model, moved.qpos, data.qvel, side * dt)
        # The same body-frame velocity in the new orientation.
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, moved.qpos[3:7])
        moved.qvel[:3] = rotation.reshape(3, 3) @ v[:3]
        robot.update(state_of(moved))
        after = [robot.com, *(robot.limb(i) for i in range(model.nsite))]
        velocities.append([np.array(point.velocity) for point in after])
    for drift, before, after in zip(drifts, *velocities, strict=True):
        np.testing.assert_allclose((after - before) / (2 * dt), drift, atol=1e-6)


def test_bad_robots_are_refused():
    trunk, leg = BodyDescription(), BodyDescription()
    trunk.name, trunk.mass, trunk.inertia = "trunk", 1.0, np.eye(3)
    leg.name, leg.parent = "leg", 7
    with pytest.raises(ValueError, match="body 'leg': parent is 7"):
        RobotModel(RobotDescription([trunk, leg], []))


def test_a_state_of_another_robot_is_refused():
    robot = RobotModel(describe_robot(ROBOTS["a1"]()))
    state = RobotState()
    state.joint_positions = state.joint_velocities = np.zeros(5)
    with pytest.raises(ValueError, match="5 joint positions"):
        robot.update(state)
