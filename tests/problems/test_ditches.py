"""Ditches: both formulations forbid the same strips, and a course is crossed."""

import numpy as np
import pytest

from palanquin.errors import ProblemError
from palanquin.problems import clm
from palanquin.problems import modules as m
from palanquin.sim.runs.nominal import follow
from palanquin.sim.scenarios.ditches import RandomDitches

LINES = np.array([[1.0, 0.2, -0.3, 0.4], [0.1, -2.0, 0.5, 0.3]])


@pytest.fixture(scope="module")
def squared(team):
    return clm.build_clm(team, ditches=m.Ditches(2, formulation="squared"))


def test_both_formulations_forbid_the_same_points(problem, squared, evaluate):
    near, far = evaluate(problem, seed=3), evaluate(squared, seed=3)
    random = np.random.default_rng(5)
    seen = set()
    for _ in range(30):
        point = random.uniform(-1, 1, 3)
        for evaluation in (near, far):
            evaluation.parameters["ditches"][:] = LINES
            evaluation.values["left.LF.foot"] = point
        depth = near.rows("ditch", "LF", "left")
        offset = np.abs(LINES[:, :2] @ point[:2] + LINES[:, 2]) / np.hypot(*LINES[:, :2].T)
        np.testing.assert_allclose(depth, LINES[:, 3] / 2 - offset, atol=1e-12)
        squares = far.rows("ditch", "LF", "left")
        np.testing.assert_allclose(squares, LINES[:, 3] ** 2 / 4 - offset**2, atol=1e-12)
        assert ((depth > 0) == (squares > 0)).all()
        seen |= set((depth > 0).tolist())
    assert seen == {True, False}


def test_unknown_formulation_names_the_known_ones():
    with pytest.raises(ProblemError, match=r"formulation.*'cubed'.*distance, squared"):
        m.Ditches(2, formulation="cubed")


def test_a_pair_of_robots_crosses_wide_ditches(team):
    """With look-ahead footholds and a few choices side by side, a random course is walked."""
    lines = np.array(RandomDitches(type="random", count=4).draw(1))
    problem = clm.build_clm(team, ditches=12)
    planner = clm.Planner(
        problem, ditches=lines, candidates=4, footholds="raibert", max_iterations=2
    )
    state, command = planner.nominal_state(), clm.Velocity(0.4)
    planner.settle(0.0, state, command)
    end = -lines[-1, 2] + lines[-1, 3] / 2
    for tick in range(250):
        plan = planner.solve(tick / 30, state, command)
        now, state = follow(planner, plan, state, 1 / 30)
        standing = now.feet[plan.contacts[0]]
        depth = lines[:, 3] / 2 - np.abs(standing[:, :2] @ lines[:, :2].T + lines[:, 2])
        assert depth.max() < 1e-3
    assert state.feet[..., 0].min() > end
