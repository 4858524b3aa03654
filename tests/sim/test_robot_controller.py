"""The whole-body controller on the robots as we build them, with and without an arm."""

import numpy as np
import pytest

from palanquin import _sim
from palanquin.problems.robots import A1, ALIENGO, FEET, LAIKAGO
from palanquin.sim.scenes.inverse_kinematics import InverseKinematics
from palanquin.sim.scenes.quadruped import armed_quadruped, bare_quadruped
from palanquin.sim.scenes.robot_description import describe_robot

pytestmark = pytest.mark.bindings

GRAVITY = 9.81
ROLL = 15
"""Index of the forearm's roll."""

models = pytest.mark.parametrize("model", [A1, LAIKAGO, ALIENGO], ids=lambda m: m.name)


def standing(model):
    """A description, and a state in which the robot stands and its hand is where it usually is."""
    trunk = np.array([0.0, 0.0, model.lumped.standing_height])
    feet = [(x, y, model.foot_radius) for x, y, _ in model.lumped.hips]
    points = np.array([*feet, trunk + np.array(model.lumped.hand)])
    solution = InverseKinematics(model).solve(trunk, np.array([1.0, 0, 0, 0]), points)
    state = _sim.RobotState()
    state.base_position = trunk
    state.joint_positions = solution.angles
    state.joint_velocities = np.zeros(solution.angles.size)
    return describe_robot(armed_quadruped(model, visual=False)), state


def solve(model, load=None):
    """Controls a robot that stands under a hand's load, for one period."""
    robot, state = standing(model)
    settings = _sim.RobotControlSettings()
    settings.posture = [ROLL]
    settings.whole_body.force_weight = 1.0  # nobody has planned what each of the feet is to bear
    controller = _sim.RobotController(robot, np.array(model.lumped.hips), settings)
    seen = controller.observe(state)
    target = _sim.RobotTarget()
    target.position = seen.position
    target.forces = np.tile([0.0, 0.0, controller.model.mass * GRAVITY / 4], (4, 1))
    if load is not None:
        hand = _sim.HandTarget()
        hand.point.position = seen.hands[0].position
        hand.wrench.force, hand.wrench.moment = load[:3], load[3:]
        target.hands = [hand]
    controller.update(0.0, 1e-3, state, target.forces, target)
    assert controller.result.is_usable
    return controller, robot


@models
def test_descriptions_have_four_feet_and_a_hand(model):
    armed = describe_robot(armed_quadruped(model, visual=False))
    bare = describe_robot(bare_quadruped(model))
    assert [limb.name for limb in armed.limbs()] == [*FEET, "hand"]
    assert [limb.name for limb in bare.limbs()] == list(FEET)
    assert [limb.kind for limb in armed.limbs()] == [_sim.LimbKind.FOOT] * 4 + [_sim.LimbKind.HAND]
    assert [limb.radius for limb in armed.limbs()] == [model.foot_radius] * 4 + [0.0]


@models
def test_an_armed_robot_stands_and_holds_its_arm(model):
    controller, _ = solve(model)
    weight = controller.model.mass * GRAVITY
    assert controller.result.forces[:, 2].sum() == pytest.approx(weight, rel=0.01)
    assert np.abs(controller.slack[:6]).max() < 0.5  # of 9.81: torques cost a little


@models
def test_an_armed_robot_carries_what_its_hand_holds(model):
    """Forces balance robot and load; so do their moments about the centre of mass."""
    load = np.array([3.0, 0.0, -2.0 * model.mass, 0.5, -1.0, 0.0])
    controller, _ = solve(model, load)
    result, com = controller.result, controller.model.com.position
    forces = result.forces.sum(axis=0) + load[:3]
    weight = controller.model.mass * GRAVITY
    np.testing.assert_allclose(forces, [0.0, 0.0, weight], atol=0.02 * weight)
    arms = [controller.model.limb(i).position - com for i in range(5)]
    moments = sum(np.cross(arm, force) for arm, force in zip(arms, result.forces, strict=True))
    moments = moments + np.cross(arms[4], load[:3]) + load[3:]
    np.testing.assert_allclose(moments, 0.0, atol=0.01 * weight)
    assert np.abs(controller.slack[:9]).max() < 0.5
