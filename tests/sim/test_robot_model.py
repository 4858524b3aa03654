"""The MuJoCo robots are the published ones: masses, inertias, dimensions, limits."""

import mujoco
import numpy as np
import pytest

from palanquin.errors import PalanquinError
from palanquin.problems.robots import DYNAARM, FEET, LAIKAGO, QUADRUPEDS, quadruped
from palanquin.sim.scenes.inverse_kinematics import JOINTS, InverseKinematics
from palanquin.sim.scenes.quadruped import armed_quadruped

PUBLISHED_TOTAL = {"laikago": 25.433, "a1": 12.453, "aliengo": 23.24}

robots = pytest.mark.parametrize("model", QUADRUPEDS.values(), ids=QUADRUPEDS)


def tensor(link):
    xx, yy, zz, xy, xz, yz = link.inertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def body_tensor(mj, name):
    body = mj.body(name)
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, body.iquat)
    rotation = rotation.reshape(3, 3)
    return rotation @ np.diag(body.inertia) @ rotation.T


def standing(model):
    """MuJoCo model and data of a robot at its nominal height, hand at its default place."""
    mj = armed_quadruped(model, visual=False).compile()
    data = mujoco.MjData(mj)
    lumped = model.lumped
    trunk = np.array([0.0, 0.0, lumped.standing_height])
    feet = [(x, y, model.foot_radius) for x, y, _ in lumped.hips]
    targets = np.array([*feet, trunk + np.array(lumped.hand)])
    solution = InverseKinematics(model).solve(trunk, np.array([1.0, 0, 0, 0]), targets)
    assert solution.error.max() < 1e-6
    data.qpos[:7] = [*trunk, 1, 0, 0, 0]
    for name, angle in zip(JOINTS, solution.angles, strict=True):
        data.joint(name).qpos = angle
    mujoco.mj_forward(mj, data)
    return mj, data


def composite(mj, data, bodies):
    """Mass, centre of mass and inertia tensor about it (world axes) of some bodies."""
    mass = mj.body_mass[bodies].sum()
    centre = mj.body_mass[bodies] @ data.xipos[bodies] / mass
    inertia = np.zeros((3, 3))
    for body in bodies:
        rotation = data.ximat[body].reshape(3, 3)
        arm = data.xipos[body] - centre
        inertia += rotation @ np.diag(mj.body_inertia[body]) @ rotation.T
        inertia += mj.body_mass[body] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return mass, centre, inertia


@robots
def test_mass_is_the_sum_of_the_published_links(model):
    mj = armed_quadruped(model).compile()
    assert model.mass == pytest.approx(PUBLISHED_TOTAL[model.name], abs=1e-9)
    assert mj.body_mass.sum() == pytest.approx(model.mass + DYNAARM.mass, abs=1e-9)


@robots
@pytest.mark.parametrize("foot", FEET)
def test_links_have_the_published_inertia_mirrored(model, foot):
    mj = armed_quadruped(model).compile()
    front, left = (1 if foot[1] == "F" else -1), (1 if foot[0] == "L" else -1)
    for name in ("hip", "thigh", "calf", "foot"):
        link = model.links[name]
        mirror = np.diag([front if name == "hip" else 1, left, 1])
        np.testing.assert_allclose(mj.body(f"{foot}_{name}").ipos, mirror @ link.com, atol=1e-12)
        expected = mirror @ tensor(link) @ mirror
        np.testing.assert_allclose(body_tensor(mj, f"{foot}_{name}"), expected, atol=1e-12)


@robots
def test_trunk_and_arm_have_the_published_inertia(model):
    mj = armed_quadruped(model).compile()
    np.testing.assert_allclose(body_tensor(mj, "trunk"), tensor(model.links["trunk"]), atol=1e-12)
    names = ("arm_base", "arm_yaw", "arm_shoulder", "arm_elbow", "arm_roll")
    for name, link in zip(names, DYNAARM.links.values(), strict=True):
        np.testing.assert_allclose(body_tensor(mj, name), tensor(link), atol=1e-12)


@robots
def test_shapes_weigh_nothing(model):
    painted = armed_quadruped(model).compile()
    bare = armed_quadruped(model, visual=False).compile()
    assert painted.ngeom > bare.ngeom
    np.testing.assert_array_equal(painted.body_mass, bare.body_mass)
    np.testing.assert_array_equal(painted.body_inertia, bare.body_inertia)


@robots
def test_limits_are_the_published_ones(model):
    mj = armed_quadruped(model).compile()
    for foot in FEET:
        lower, upper = mj.joint(f"{foot}_calf").range
        assert lower == model.joints["calf"].lower
        assert upper == model.joints["calf"].upper
        assert mj.actuator(f"{foot}_hip").ctrlrange[1] == model.joints["hip"].effort
    hip = model.joints["hip"]
    assert tuple(mj.joint("RF_hip").range) == (-hip.upper, -hip.lower)
    assert bool(mj.joint("LF_thigh").limited[0]) == np.isfinite(model.joints["thigh"].lower)


@robots
def test_lumped_model_with_arm_is_the_composite_of_the_links(model):
    mj, data = standing(model)
    mass, centre, inertia = composite(mj, data, np.arange(1, mj.nbody))
    lumped = model.single_rigid_body("dynaarm")
    assert lumped.mass == pytest.approx(mass, abs=1e-3)
    np.testing.assert_allclose(lumped.inertia, np.diag(inertia), atol=2e-3)
    offset = centre - data.body("trunk").xpos
    np.testing.assert_allclose(lumped.centre_of_mass, offset * (1, 0, 1), atol=2e-3)
    # The same points of the robot, seen from the common centre of mass.
    np.testing.assert_allclose(
        np.add(lumped.hips, lumped.centre_of_mass), model.lumped.hips, atol=1e-12
    )
    assert lumped.standing_height == pytest.approx(
        model.standing_height + lumped.centre_of_mass[2], abs=1e-12
    )


@robots
def test_lumped_model_without_arm_is_close_to_the_bare_robot(model):
    """Published lumped numbers and the links' composite differ by posture and rounding only."""
    mj, data = standing(model)
    bare = [b for b in range(1, mj.nbody) if not mj.body(b).name.startswith("arm")]
    mass, centre, inertia = composite(mj, data, np.array(bare))
    assert model.lumped.mass == pytest.approx(mass, rel=0.01)
    np.testing.assert_allclose(model.lumped.inertia, np.diag(inertia), rtol=0.15)
    assert np.linalg.norm(centre - data.body("trunk").xpos) < 0.025


def test_laikago_plans_with_table_one():
    body = LAIKAGO.single_rigid_body()
    assert (body.mass, body.inertia) == (25.2, (0.4, 1.0, 1.0))
    assert (body.leg_length, body.arm_length) == (0.4, 0.4)
    assert body.hips == ((0.21, 0.13, 0), (0.21, -0.13, 0), (-0.21, 0.13, 0), (-0.21, -0.13, 0))
    assert (body.arm, body.hand) == ((0.15, 0.0, 0.05), (0.38, 0.0, 0.15))


@robots
def test_planned_reach_is_within_the_real_leg(model):
    longest = model.thigh_length + model.calf_length
    assert model.lumped.leg_length <= 0.9 * longest
    gap = np.subtract(model.hips, model.lumped.hips)
    assert np.abs(gap).max() < 0.011


def test_unknown_names_are_listed():
    with pytest.raises(PalanquinError, match=r"'spot'.*a1, aliengo, laikago"):
        quadruped("spot")
    with pytest.raises(PalanquinError, match=r"'heavy'.*massless.*dynaarm"):
        LAIKAGO.single_rigid_body("heavy")
