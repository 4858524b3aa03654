"""Forces that keep their value for several knots: fewer inputs, the same motion nearly."""

import numpy as np
import pytest

from palanquin.errors import ProblemError
from palanquin.problems import clm


@pytest.fixture(scope="module")
def problem(team_abreast):
    return clm.build_clm(team_abreast, holds_inputs=True)


def settled(problem, knots, **options):
    planner = clm.Planner(problem, input_blocks=knots, **options)
    state = planner.nominal_state()
    plan = planner.settle(0.0, state, clm.Velocity(0.4))
    assert plan.plan.is_usable
    return plan


@pytest.mark.parametrize("qp", ["structured", "osqp"])
def test_forces_change_between_blocks_only(problem, qp):
    plan = settled(problem, 4, qp=qp)
    stands = plan.contacts[:-1]
    for k in range(1, len(plan.forces)):
        kept = stands[k] & stands[k - 1] if k % 4 else np.zeros_like(stands[k])
        np.testing.assert_allclose(plan.forces[k][kept], plan.forces[k - 1][kept], atol=1e-6)
        if k % 4:
            np.testing.assert_allclose(plan.hand_wrenches[k], plan.hand_wrenches[k - 1], atol=1e-6)
    assert np.abs(np.diff(plan.hand_wrenches[::4], axis=0)).max() > 0.01


def test_blocks_of_one_knot_are_free_inputs(problem, team_abreast):
    free = clm.Planner(clm.build_clm(team_abreast))
    plan = free.settle(0.0, free.nominal_state(), clm.Velocity(0.4))
    same = settled(problem, 1)
    assert same.plan.cost == pytest.approx(plan.plan.cost, rel=1e-9)


def test_longer_blocks_cost_more(problem):
    costs = [settled(problem, knots).plan.cost for knots in (1, 2, 4)]
    assert costs == sorted(costs)
    assert costs[0] < costs[-1]


@pytest.mark.parametrize("knots", [0, -1, 1.5])
def test_blocks_have_at_least_a_knot(problem, knots):
    with pytest.raises(ProblemError, match="at least 1"):
        clm.Planner(problem, input_blocks=knots)


def test_a_problem_that_holds_no_inputs_says_so(team_abreast):
    with pytest.raises(ProblemError, match="holds_inputs=True"):
        clm.Planner(clm.build_clm(team_abreast), input_blocks=2)
