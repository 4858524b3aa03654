"""Rows of torques against the inverse dynamics of robots that stand, and what they do to a plan."""

import casadi as ca
import mujoco
import numpy as np
import pytest

from palanquin import lowering
from palanquin.errors import ProblemError
from palanquin.problems import clm
from palanquin.problems import modules as m
from palanquin.problems.modules.limits import TORQUE_UNIT
from palanquin.problems.quaternions import from_rotation_vector, multiply
from palanquin.problems.robots import FEET, LAIKAGO, quadruped
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import open_scenario
from palanquin.sim.scenarios.physical import physical
from palanquin.sim.scenes.held_scene import build_held_scene

TROT = physical(open_scenario("trot"))
LEG, ARM = ("hip", "thigh", "calf"), ("yaw", "shoulder", "elbow", "roll")


def carried_by(kind):
    """Of a payload that such robots can bear, where their hands are by default."""
    body = quadruped(kind).single_rigid_body("dynaarm")
    height = body.standing_height + body.hand[2]
    robots = [robot.changed(model=kind) for robot in TROT.robots]
    return TROT.changed(robots=robots, payload={**dict(TROT.payload), "height": height})


def disturbed(state, random):
    """Bodies a little turned, feet and payload a little elsewhere."""
    for body in state.bodies:
        turn = from_rotation_vector(random.uniform(-0.08, 0.08, 3))
        body[3:7] = multiply(body[3:7], turn)
        body[:3] += random.uniform(-0.03, 0.03, 3)
    state.feet[..., :2] += random.uniform(-0.05, 0.05, state.feet[..., :2].shape)


class Wrenches:
    """Random ones on feet and hands of a team, as a standing team has them."""

    def __init__(self, random, robots):
        self.feet = random.uniform([-40, -40, 30], [40, 40, 200], (robots, 4, 3))
        self.hands = random.uniform([-40, -40, -120, -8, -8, -8], [40, 40, 0, 8, 8, 8], (robots, 6))


def torques_of_rows(scenario, state, wrenches):
    """Torques of legs [R, 4, 3] and arms [R, 4] as the rows have them, N m."""
    options = {"leg_torque": m.LegTorque(), "arm_torque": m.ArmTorque()}
    problem = clm.build_clm(scenario.team, terrain=scenario.ground, limits=options)
    values = {}
    for body, row in zip(scenario.team.bodies, state.bodies, strict=True):
        for part, columns in clm.references.PARTS.items():
            values[f"{body}.{part}"] = row[columns]
    for i, robot in enumerate(scenario.team.robots):
        for f, limb in enumerate(FEET):
            values[f"{robot}.{limb}.foot"] = state.feet[i, f]
            values[f"{robot}.{limb}.force"] = wrenches.feet[i, f]
        values[f"{robot}.hand.force"], values[f"{robot}.hand.torque"] = (
            wrenches.hands[i, :3],
            wrenches.hands[i, 3:],
        )
    k = lowering.knot_symbols(problem)
    z = np.concatenate([values[b.name] for b in problem.blocks])
    p = np.concatenate([q.default.ravel() for q in problem.parameters])
    limits = {q.name: q.default.ravel() for q in problem.parameters}

    def read(family, size, name):
        found = []
        for robot in scenario.team.robots:
            rows = [r for r in problem.rows if r.name == family and r.robot == robot]
            values = ca.Function("rows", [k.z, k.p], [ca.vertcat(*(r.expression for r in rows))])
            both = np.array(values(z, p)).reshape(-1, 2, size) * TORQUE_UNIT
            most = limits[f"{robot}.{name}"]
            np.testing.assert_allclose(both.sum(axis=1), -2 * np.tile(most, (len(both), 1)))
            found.append(both[:, 0] + most)
        return np.array(found)

    legs = read("leg_torque", 3, "leg_torque_limits")
    return legs, read("arm_torque", 4, "arm_torque_limits")[:, 0]


def torques_of_inverse_dynamics(scenario, state, wrenches):
    """The same from MuJoCo's model at rest, links' weights included."""
    scene = build_held_scene(scenario.scene, state, 0.8)
    model, data = scene.model, scene.data()
    data.qvel[:] = 0
    mujoco.mj_forward(model, data)
    torque = data.qfrc_bias.copy()

    def bear(body, point, wrench):
        linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, linear, angular, point, body)
        torque[:] -= linear.T @ wrench[:3] + angular.T @ wrench[3:]

    for i, robot in enumerate(scenario.team.robots):
        for f, limb in enumerate(FEET):
            foot = model.body(f"{robot}/{limb}_foot").id
            assert np.linalg.norm(data.xpos[foot] - state.feet[i, f]) < 0.03
            bear(foot, state.feet[i, f], np.append(wrenches.feet[i, f], np.zeros(3)))
        hand = data.site(f"{robot}/hand")
        bear(model.site_bodyid[hand.id], hand.xpos, wrenches.hands[i])

    def at(joint):
        return torque[model.joint(joint).dofadr[0]]

    robots = scenario.team.robots
    legs = [[[at(f"{r}/{limb}_{joint}") for joint in LEG] for limb in FEET] for r in robots]
    return np.array(legs), np.array([[at(f"{r}/arm_{joint}") for joint in ARM] for r in robots])


@pytest.mark.parametrize("kind", ["laikago", "a1", "aliengo"])
def test_rows_are_the_torques_of_a_standing_robot(kind):
    random = np.random.default_rng(3)
    scenario = carried_by(kind)
    for _ in range(4):
        state = scenario.start_state()
        disturbed(state, random)
        wrenches = Wrenches(random, 2)
        legs, arms = torques_of_rows(scenario, state, wrenches)
        true_legs, true_arms = torques_of_inverse_dynamics(scenario, state, wrenches)
        assert np.abs(true_legs).max() > 20.0
        np.testing.assert_allclose(legs, true_legs, atol=1.5)  # the legs' own weight is left out
        np.testing.assert_allclose(arms, true_arms, atol=0.01)


def pushed_back(**planner):
    """A robot that trots is pushed backwards by 164 N for 0.8 s."""
    push = {"body": "left", "force": [-164, 0, 0], "start": 0.8, "duration": 0.8}
    return TROT.changed(
        pushes=[push],
        duration=2.0,
        planner={**dict(TROT.planner), **planner},
    )


def test_a_push_that_topples_a_team_without_rows_is_survived_with_them():
    without = run_scenario(pushed_back(leg_torque=None, arm_torque=None))
    assert "left/trunk touched the ground" in without.fall
    assert outcome(run_scenario(pushed_back()))["completed"]


def test_a_robot_that_does_not_say_where_its_motors_are_has_no_rows():
    body = LAIKAGO.single_rigid_body()
    team = clm.Team(clm.Payload(), (clm.Carrier("one", (0, 0, 0), body),))
    for limits in ({"leg_torque": m.LegTorque()}, {"arm_torque": m.ArmTorque()}):
        with pytest.raises(ProblemError, match="'one' has no motors"):
            clm.build_clm(team, limits=limits)


@pytest.mark.parametrize("share", [0.0, -1.0, np.nan])
def test_bad_shares_are_refused(share):
    for limits in (m.LegTorque, m.ArmTorque):
        with pytest.raises(ProblemError, match="share"):
            limits(share)
