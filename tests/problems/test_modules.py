"""The modules' physics: what holds for any numbers."""

import casadi as ca
import numpy as np
import pytest

from palanquin.errors import ProblemError
from palanquin.problem import Problem, Role
from palanquin.problems import clm, quaternions, terrains
from palanquin.problems import modules as m
from palanquin.problems.robots import LAIKAGO

FEET = ["LF", "RF", "LH", "RH"]
G = np.array([0, 0, -9.81])
DT = 1 / 30


def masses(team):
    return np.array([team.payload.mass, *(c.model.mass for c in team.carriers)])


def test_only_ground_and_gravity_change_the_teams_momentum(team, evaluation):
    contact = np.array([1.0, 0.0, 1.0, 1.0])
    evaluation.parameters["left.contact"][:] = contact
    z = evaluation.values
    mass = masses(team)
    linear, angular = np.zeros(3), np.zeros(3)
    for b, body in enumerate(team.bodies):
        change = mass[b] * evaluation.increment(f"{body}.velocity")
        inertia = evaluation.parameters[f"{body}.inertia"]
        spin, q = z[f"{body}.angular_velocity"], z[f"{body}.orientation"]
        torque = inertia * evaluation.increment(f"{body}.angular_velocity") / DT
        torque = quaternions.rotate(q, torque + np.cross(spin, inertia * spin))
        linear += change
        angular += np.cross(z[f"{body}.position"], change) + DT * torque
    expected_linear, expected_angular = DT * mass.sum() * G, np.zeros(3)
    for b, body in enumerate(team.bodies):
        expected_angular += DT * np.cross(z[f"{body}.position"], mass[b] * G)
    for robot, flags in (("left", contact), ("right", np.ones(4))):
        for f, limb in enumerate(FEET):
            force = DT * flags[f] * z[f"{robot}.{limb}.force"]
            expected_linear += force
            expected_angular += np.cross(z[f"{robot}.{limb}.foot"], force)
    np.testing.assert_allclose(linear, expected_linear, atol=1e-12)
    np.testing.assert_allclose(angular, expected_angular, atol=1e-12)


def test_poses_move_with_the_next_velocities(evaluation):
    for body in ("payload", "left"):
        step = evaluation.increment(f"{body}.position")
        np.testing.assert_allclose(step, DT * evaluation.next[f"{body}.velocity"])
        turn = evaluation.increment(f"{body}.orientation")
        np.testing.assert_allclose(turn, DT * evaluation.next[f"{body}.angular_velocity"])


def test_external_wrench_acts_on_its_body(evaluation):
    before = {n: evaluation.increment(n) for n in ("left.velocity", "left.angular_velocity")}
    evaluation.parameters["left.external_force"][:] = 0.0, 164.0, 0.0
    change = evaluation.increment("left.velocity") - before["left.velocity"]
    np.testing.assert_allclose(change, [0, DT * 164.0 / 25.2, 0], atol=1e-14)
    evaluation.parameters["left.external_torque"][:] = 1.0, 2.0, 3.0
    change = evaluation.increment("left.angular_velocity") - before["left.angular_velocity"]
    q = evaluation.values["left.orientation"]
    torque = quaternions.rotate_inverse(q, np.array([1.0, 2.0, 3.0]))
    np.testing.assert_allclose(evaluation.parameters["left.inertia"] * change / DT, torque)


@pytest.mark.parametrize(
    ("contact", "previous", "role"),
    [(1, 1, Role.CARRIED), (1, 0, Role.INPUT), (0, 1, Role.LOCAL), (0, 0, Role.LOCAL)],
)
def test_roles_of_a_foot(evaluation, problem, contact, previous, role):
    evaluation.parameters["left.contact"][1] = contact
    evaluation.parameters["left.previous_contact"][1] = previous
    blocks = {b.name: b for b in problem.blocks}
    assert evaluation(blocks["left.RF.foot"].role) == role
    assert evaluation(blocks["left.RF.force"].role) == (Role.INPUT if contact else Role.ABSENT)
    assert evaluation(ca.SX(blocks["left.RF.foot"].chart.active)) == contact
    rf = 1
    assert evaluation.active("friction")[rf] == evaluation.active("normal")[rf] == contact
    assert evaluation.active("leg").all()


def test_charted_foot_is_on_the_ground(evaluation, problem):
    chart = next(b for b in problem.blocks if b.name == "right.LH.foot").chart
    foot = evaluation(chart.embed(ca.SX([2.5, 0.3])))
    ramp = terrains.Ramp(height=1.6, slope=0.8, x=3.0)
    np.testing.assert_allclose(foot, [2.5, 0.3, ramp.height(2.5, 0.3)])


def test_friction_pyramid_on_the_slope(evaluation):
    ramp, mu = terrains.Ramp(height=1.6, slope=0.8, x=3.0), 0.8
    foot = evaluation.values["left.LF.foot"]
    force = evaluation.values["left.LF.force"] = np.array([30.0, -20.0, 70.0])
    gx, gy = ramp.gradient(foot[0], foot[1])
    normal = ramp.normal(foot[0], foot[1])
    t_xz = np.array([1, 0, gx]) / np.hypot(1, gx)
    t_yz = np.array([0, 1, gy]) / np.hypot(1, gy)
    rows = evaluation.rows("friction", "LF", "left")
    expected = [abs(force @ t) - mu * force @ normal for t in (t_xz, t_yz)]
    np.testing.assert_allclose(np.sort(100 * rows)[-2:], np.sort(expected))
    assert 100 * evaluation.rows("normal", "LF", "left")[0] == pytest.approx(-force @ normal)


def test_reach_of_legs_and_arms(team, evaluation):
    z = evaluation.values
    q, p = z["right.orientation"], z["right.position"]
    model = team.carriers[1].model
    hip = p + quaternions.rotate(q, np.array(model.hips[2]))
    leg = np.linalg.norm(z["right.LH.foot"] - hip) - model.leg_length
    assert evaluation.rows("leg", "LH", "right")[0] == pytest.approx(leg)
    grasp = z["payload.position"] + quaternions.rotate(
        z["payload.orientation"], np.array(team.carriers[1].attach)
    )
    arm = np.linalg.norm(grasp - p - quaternions.rotate(q, np.array(model.arm)))
    assert evaluation.rows("arm", robot="right")[0] == pytest.approx(arm - model.arm_length)


def test_reach_has_a_derivative_at_zero_length():
    v = ca.SX.sym("v", 3)
    norm = m.limits.smooth_norm(v)
    slope = ca.Function("slope", [v], [ca.jacobian(norm, v)])
    assert np.isfinite(np.array(slope(np.zeros(3)))).all()


def test_ditch_rows(evaluation):
    evaluation.parameters["ditches"][1] = 3.0, 4.0, -1.0, 0.5
    evaluation.values["left.RH.foot"] = np.array([0.4, 0.1, 0.0])
    rows = evaluation.rows("ditch", "RH", "left")
    assert rows[1] == pytest.approx(0.25 - abs(3 * 0.4 + 4 * 0.1 - 1) / 5)
    np.testing.assert_array_equal(evaluation.active("ditch")[:4], [0, 1, 0, 1])


def test_a_foot_in_the_middle_of_a_ditch_is_pushed_out():
    foot = ca.SX.sym("foot", 3)
    depth = m.ditches.intrusion(ca.SX([[1.0, 0.0, -0.5, 0.3]]), foot)
    slope = ca.Function("slope", [foot], [ca.jacobian(depth, foot)])
    assert abs(float(slope([0.5, 0, 0])[0])) == 1.0


def test_costs_of_tracking(team, evaluation):
    """The reference has no cost, the terminal cost carries w_N, the payload w^0."""
    for b in evaluation.problem.blocks:
        reference = b.name.split(".", 1)
        name = f"{reference[0]}.reference.{reference[1]}"
        if name in evaluation.parameters:
            evaluation.parameters[name][:] = b_value = evaluation.values[b.name].copy()
            if b.is_quaternion:  # either sign is the same orientation
                evaluation.parameters[name][:] = -b_value
    assert evaluation.cost("terminal") == pytest.approx(0, abs=1e-28)
    evaluation.parameters["payload.reference.position"][:] += [0.1, 0.0, 0.2]
    assert evaluation.cost("terminal") == pytest.approx(10 * 10 * (10 * 0.01 + 42 * 0.04))
    evaluation.parameters["payload.weight.terminal"][:] = 1.0
    assert evaluation.cost("terminal") == pytest.approx(10 * (10 * 0.01 + 42 * 0.04))


def test_terrain_must_come_after_the_robots():
    problem = Problem(horizon=5, dt=0.1)
    problem.add(m.ArmedQuadruped("spot", LAIKAGO))
    chart = next(b for b in problem.blocks if b.name == "spot.LF.foot").chart
    with pytest.raises(ProblemError, match=r"foot LF of 'spot' has no ground: add Terrain"):
        chart.embed(ca.SX.zeros(2))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: m.RigidBody("box", -1, [1, 1, 1]), r"box.mass is -1; it must be positive"),
        (lambda: m.RigidBody("box", 1, [1, 0, 1]), r"box.inertia is .* must be positive"),
        (lambda: m.RigidBody("box", 1, [1, 1]), r"box.inertia has shape \(2,\); \(3,\) is needed"),
        (lambda: m.Terrain(friction=0.0), r"terrain.friction is 0.0"),
        (lambda: m.Ditches(0), r"ditches.at_most is 0"),
        (lambda: m.Ditches(1, [[1, 0, 0, 1]] * 2), r"ditches: 2 are given; at most 1"),
        (lambda: m.Ditches(1, [[0, 0, 1, 1]]), r"ditches\[0\]: a and b are both 0"),
        (lambda: m.Ditches(1, [[1, 0, 1, -1]]), r"ditches\[0\].d is -1"),
        (lambda: clm.Team(clm.Payload(), ()), r"team.carriers is empty"),
        (
            lambda: clm.Team(clm.Payload(), (clm.Carrier("a", (0, 0, 0)),) * 2),
            r"\['a', 'a'\]; names must differ",
        ),
        (lambda: clm.Payload(mass=float("nan")), r"payload.mass is nan"),
    ],
)
def test_bad_input_is_refused(make, message):
    with pytest.raises(ProblemError, match=message):
        make()


def test_team_is_read_back_from_its_problem(team, problem):
    again = clm.Team.of(problem)
    assert again.robots == ["left", "right"]
    assert again.payload.height == pytest.approx(0.32 + 0.15)
    np.testing.assert_array_equal(again.attach(), team.attach())
    assert again.carriers[1].yaw == 0.4
    with pytest.raises(ProblemError, match="grasps of nothing"):
        clm.Team.of(Problem(horizon=3, dt=0.1))
