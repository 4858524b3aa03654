"""Contact-wrench cones: their rows against the physics of a pad, and a plan that keeps to one."""

import casadi as ca
import numpy as np
import pytest

from palanquin.errors import ProblemError
from palanquin.plan import Status
from palanquin.problems import clm, quaternions
from palanquin.problems import modules as m
from palanquin.problems.modules.wrench_cone import WrenchCone, cone_rows

CONE = WrenchCone(grip=100.0, friction=0.5, torsion=0.02, half_size=0.03)
RANDOM = np.random.default_rng(0)


def rows(force, torque, orientation=(1.0, 0.0, 0.0, 0.0), yaw=0.0):
    arguments = [ca.SX(ca.DM(a)) for a in (force, torque, orientation)]
    return np.array(ca.evalf(cone_rows(*arguments, yaw, ca.SX(CONE.values())))).squeeze()


@pytest.mark.parametrize(
    ("force", "torque", "holds"),
    [
        ((0, 0, 0), (0, 0, 0), True),
        ((-99, 0, 0), (0, 0, 0), True),  # the grip holds what pulls
        ((-101, 0, 0), (0, 0, 0), False),
        ((0, 49, 0), (0, 0, 0), True),  # half of the normal force
        ((0, 0, -51), (0, 0, 0), False),
        ((20, 0, -59), (0, 0, 0), True),  # pressing helps
        ((0, 0, 0), (1.9, 0, 0), True),
        ((0, 0, 0), (-2.1, 0, 0), False),
        ((0, 0, 0), (0, 2.9, 0), True),  # the centre of pressure is on the pad
        ((0, 0, 0), (0, 0, -3.1), False),
    ],
)
def test_rows_hold_what_a_pad_holds(force, torque, holds):
    assert (rows(force, torque).max() <= 0) == holds


def test_rows_turn_with_the_hand():
    for _ in range(10):
        force, torque = RANDOM.normal(size=3) * 60, RANDOM.normal(size=3)
        q = RANDOM.normal(size=4)
        q, yaw = q / np.linalg.norm(q), RANDOM.uniform(-3, 3)
        hand = quaternions.multiply(q, quaternions.from_yaw(np.array(yaw)))
        turned = rows(quaternions.rotate(hand, force), quaternions.rotate(hand, torque), q, yaw)
        np.testing.assert_allclose(turned, rows(force, torque), atol=1e-12)


def test_a_plan_keeps_to_the_cone(team_abreast):
    """Without limits the hands twist the payload far more than weak pads can."""
    # The cone's rows contend with each other: 6 QPs a step leave the subproblem far from its end.
    enough = {"max_inner_iterations": 20}
    free = clm.Planner(clm.build_clm(team_abreast))
    weak = WrenchCone(grip=200.0, friction=0.6, torsion=0.001, half_size=0.002)
    held = clm.Planner(clm.build_clm(team_abreast, hand_cone=weak), subproblem=enough)

    def twist(planner):
        state = planner.nominal_state()
        state.bodies[0, 7:] += 0.2  # the payload moves and turns
        return planner.settle(0.0, state, clm.Velocity(0.3))

    plan = twist(held)
    assert plan.plan.status == Status.CONVERGED
    assert plan.plan.violation["hand"] < 0.01  # N
    moments = [np.abs(p.hand_wrenches[..., 3:]).max() for p in (plan, twist(free))]
    assert moments[0] < 0.6
    assert moments[1] > 2 * moments[0]


@pytest.mark.parametrize("name", ["grip", "friction", "torsion", "half_size"])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan])
def test_bad_cones_say_what_is_wrong(name, value):
    with pytest.raises(ProblemError, match=f"{name} is {value}"):
        m.WrenchCone(**{name: value})
