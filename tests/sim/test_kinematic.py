"""Kinematic tracking: MuJoCo's sites are where the rollout wants feet and hands."""

import mujoco
import numpy as np
import pytest

from palanquin.problems.robots import FEET, LAIKAGO, quadruped
from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.team import Member, Team
from palanquin.sim.scenes.scene import build_scene
from palanquin.sim.show.kinematic import track
from palanquin.sim.show.swing import foot_path

RAMP = {"type": "ramp", "H": 1.0, "kappa": 0.4, "xg": 0.6}


def sites(trajectory, frame):
    model = trajectory.scene.model
    data = mujoco.MjData(model)
    data.qpos[:] = trajectory.qpos[frame]
    mujoco.mj_forward(model, data)
    return data


def check_tracking(rollout, trajectory):
    ground = rollout.team.ground
    for frame in range(0, len(trajectory.time), 7):
        data = sites(trajectory, frame)
        at = trajectory.time[frame : frame + 1]
        for i, robot in enumerate(rollout.team.robots):
            radius = quadruped(robot.kind).foot_radius
            for f, foot in enumerate(FEET):
                point = foot_path(rollout, i, f, at)[0]
                wanted = point + radius * ground.normal(*point[:2])
                np.testing.assert_allclose(
                    data.site(f"{robot.name}/{foot}").xpos, wanted, atol=1e-6
                )
            grasp = data.site(f"grasp/{robot.name}").xpos
            np.testing.assert_allclose(data.site(f"{robot.name}/hand").xpos, grasp, atol=1e-6)


def test_feet_and_hands_are_where_they_should_be(rollout, trajectory):
    check_tracking(rollout, trajectory)
    summary = trajectory.summary()
    assert summary["foot_error_max_m"] < 1e-6
    assert summary["hand_error_max_m"] < 1e-6
    assert summary["joints_at_limit"] == {}


def test_mixed_team_on_a_ramp(make_rollout):
    rollout = make_rollout(ticks=20, kinds=("a1", "laikago", "aliengo"), terrain=RAMP)
    trajectory = track(rollout, frame_rate=30)
    check_tracking(rollout, trajectory)


def test_bodies_follow_the_measured_state(rollout, trajectory):
    model = trajectory.scene.model
    start = model.joint("payload").qposadr[0]
    for tick in (0, 17, 39):
        frame = np.argmin(np.abs(trajectory.time - rollout.time[tick]))
        assert trajectory.time[frame] == pytest.approx(rollout.time[tick], abs=1e-9)
        np.testing.assert_allclose(trajectory.qpos[frame, start : start + 7], rollout.x[tick, :7])


def test_lumped_frame_with_arm_is_not_the_trunk(make_rollout):
    """The planner's frame sits at the common centre of mass: the trunk is placed below it."""
    plain = make_rollout(ticks=2)
    body = LAIKAGO.single_rigid_body("dynaarm")
    members = tuple(Member(r.name, r.kind, r.attach, body=body) for r in plain.team.robots)
    moved = plain.x.copy()
    for i in range(2):
        moved[:, 13 * (i + 1) : 13 * (i + 1) + 3] += body.centre_of_mass
    armed = type(plain)(**{**vars(plain), "team": Team(members), "x": moved})
    np.testing.assert_allclose(track(armed).qpos, track(plain).qpos, atol=1e-6)


@pytest.mark.parametrize("option", ["frame_rate", "apex_height"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan")])
def test_bad_options_are_named(rollout, option, value):
    with pytest.raises(InputError, match=option):
        track(rollout, **{option: value})


def test_scene_has_valid_inertias_and_can_be_stepped(rollout):
    scene = build_scene(rollout.team)
    data = mujoco.MjData(scene.model)
    for _ in range(5):
        mujoco.mj_step(scene.model, data)
    assert np.isfinite(data.qpos).all()
    inertia = scene.model.body_inertia[1:]
    assert np.all(2 * inertia.max(axis=1) <= inertia.sum(axis=1) * (1 + 1e-9))
