"""Reference motions (14): rigid motion of the team, footholds on the ground, reference cases."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palanquin.errors import ProblemError
from palanquin.problems import clm, quaternions, terrains
from palanquin.problems.clm.references import ANGULAR_VELOCITY, ORIENTATION, POSITION, VELOCITY

CASES = Path(__file__).parents[1] / "data" / "cases"
RAMP = terrains.Ramp(height=1.6, slope=0.8, x=3.0)
TURN = clm.Velocity(0.4, -0.1, 0.5)


@pytest.mark.parametrize(
    ("name", "start", "command"),
    [
        ("stand", (0, 0, 0), clm.Velocity()),
        ("trot", (0, 0, 0), clm.Velocity(0.5)),
        ("ditch", (0, 0, 0), clm.Velocity(0.5)),
        ("ramp", (2, 0, 0), clm.Velocity(0.4)),
    ],
)
def test_references_of_the_cases(name, start, command):
    case = clm.CaseProblem.of(clm.load_case(CASES / f"{name}.json"))
    references = clm.make_references(
        case.team, case.case.terrain.shape(), np.array(start), command, 15, 1 / 30
    )
    np.testing.assert_allclose(references.bodies, case.references.bodies, atol=1e-14)
    np.testing.assert_allclose(references.footholds[:-1], case.case.rref, atol=1e-14)


def test_velocities_are_the_derivatives_of_the_poses_on_flat_ground(team):
    dt = 1e-5
    references = clm.make_references(team, terrains.Flat(), np.array([1, 2, 0.3]), TURN, 1, dt)
    now, later = references.bodies
    # The payload's heading turns while it moves: an error of order dt remains.
    moved = (later[:, POSITION] - now[:, POSITION]) / dt
    np.testing.assert_allclose(moved, now[:, VELOCITY], atol=1e-4)
    turned = quaternions.multiply(quaternions.conjugate(now[:, ORIENTATION]), later[:, ORIENTATION])
    spin = Rotation.from_quat(np.roll(turned, -1, axis=-1)).as_rotvec() / dt
    np.testing.assert_allclose(spin, now[:, ANGULAR_VELOCITY], atol=1e-4)


def test_team_is_one_rigid_body_anywhere(team):
    references = clm.make_references(team, RAMP, np.array([2.0, 0.0, 0.4]), TURN, 15, 1 / 30)
    payload, robots = references.bodies[:, :1], references.bodies[:, 1:]
    hands = robots[..., POSITION] + quaternions.rotate(robots[..., ORIENTATION], team.hands())
    grasps = payload[..., POSITION] + quaternions.rotate(payload[..., ORIENTATION], team.attach())
    np.testing.assert_allclose(hands, grasps, atol=1e-14)
    # Rigid: the velocity of a robot seen from the payload is that of a rotation about it.
    arm = robots[..., POSITION] - payload[..., POSITION]
    relative = robots[..., VELOCITY] - payload[..., VELOCITY]
    np.testing.assert_allclose((arm * relative).sum(-1), 0, atol=1e-14)
    spin = quaternions.rotate(robots[..., ORIENTATION], robots[..., ANGULAR_VELOCITY])
    np.testing.assert_allclose(relative, np.cross(spin, arm), atol=1e-14)


def test_yaw_turns_a_robot_against_the_payload(team):
    bodies, _ = clm.nominal_state(team, terrains.Flat(), np.array([0.0, 0.0, 0.7]))
    np.testing.assert_allclose(quaternions.yaw_of(bodies[:, ORIENTATION]), [0.7, 0.7, 1.1])


def test_payload_follows_the_slope(team):
    references = clm.make_references(team, RAMP, np.array([3.0, 0.0, 0.0]), TURN, 15, 1 / 30)
    payload = references.bodies[:, 0]
    normal = RAMP.normal(payload[:, 0], payload[:, 1])
    np.testing.assert_allclose((payload[:, VELOCITY] * normal).sum(-1), 0, atol=1e-14)
    speed = np.linalg.norm(payload[:, VELOCITY], axis=-1)
    np.testing.assert_allclose(speed, np.hypot(TURN.vx, TURN.vy))
    height = payload[:, 2] - RAMP.height(payload[:, 0], payload[:, 1])
    np.testing.assert_allclose(height, team.payload.height)


def test_footholds_are_below_the_hips_on_the_ground(team):
    references = clm.make_references(team, RAMP, np.array([3.0, 0.0, 0.2]), TURN, 5, 1 / 30)
    feet = references.feet()
    np.testing.assert_allclose(feet[..., 2], RAMP.height(feet[..., 0], feet[..., 1]), atol=1e-14)
    robots = references.bodies[:, 1:, None]
    hips = robots[..., POSITION] + quaternions.rotate(robots[..., ORIENTATION], team.hips())
    np.testing.assert_allclose(feet[..., :2], hips[..., :2], atol=1e-14)


def test_bad_commands_and_starts_are_refused(team):
    with pytest.raises(ProblemError, match=r"command.vy is nan"):
        clm.Velocity(0.1, float("nan"))
    with pytest.raises(ProblemError, match=r"start has shape \(2,\); \(3,\) is needed"):
        clm.make_references(team, RAMP, np.zeros(2), TURN, 5, 1 / 30)


def test_parameters_of_other_shapes_are_refused(team, problem):
    params = {p.name: np.zeros((6, *p.shape)) for p in problem.parameters}
    with pytest.raises(ProblemError, match=r"contacts have shape \(6, 1, 4\).*\(N\+1, 2, 4\)"):
        clm.set_contacts(params, team, np.ones((6, 1, 4)), np.ones((2, 4)))
    hill = terrains.Formula(lambda x, y, top: top * x, {"top": np.array([0.3])})
    with pytest.raises(ProblemError, match="terrain has no parameter 'top'"):
        clm.set_terrain(params, hill)


def test_previous_contacts_lag_by_one_knot(team, problem):
    params = {p.name: np.zeros((6, *p.shape)) for p in problem.parameters}
    contacts = np.random.default_rng(0).integers(0, 2, (6, 2, 4))
    before = np.array([[1, 0, 0, 1], [0, 0, 1, 1]])
    clm.set_contacts(params, team, contacts, before)
    np.testing.assert_array_equal(params["right.contact"], contacts[:, 1])
    np.testing.assert_array_equal(params["right.previous_contact"][0], before[1])
    np.testing.assert_array_equal(params["right.previous_contact"][1:], contacts[:-1, 1])


@pytest.mark.parametrize("terrain", [terrains.Flat(), RAMP])
def test_feet_below_the_load_are_centred_under_the_zero_moment_point(team, terrain):
    loaded = replace(team, feet_below="load")
    start = np.array([3.8, 0.0, 0.4])  # of the ramp: on its slope
    references = clm.make_references(loaded, terrain, start, TURN, 3, 1 / 30)
    load = team.payload.mass / len(team.carriers)
    for i, carrier in enumerate(team.carriers):
        robot = references.bodies[:, i + 1]
        hand = quaternions.rotate(robot[:, ORIENTATION], np.array(carrier.model.hand))
        force_at = load / (load + carrier.model.mass) * hand[:, :2]
        centre = references.footholds[:, i, :, :2].mean(axis=1)
        np.testing.assert_allclose(centre, force_at, atol=1e-12)


def test_what_feet_may_be_below_is_checked(team):
    with pytest.raises(ProblemError, match=r"team\.feet_below is 'hands'; it must be one of hips"):
        replace(team, feet_below="hands")
