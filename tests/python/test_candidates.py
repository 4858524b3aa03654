"""Several starts at once: the best is kept, whichever thread finds it."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

import palanquin as pq

pytestmark = pytest.mark.bindings


@pytest.fixture(scope="module")
def two_valleys() -> pq.Lowered:
    """x+ = x + dt u with the goal y^2 (y - 3)^2 + y / 10 as residuals: a better valley near 0."""
    problem = pq.Problem(horizon=8, dt=0.25, name="two_valleys")
    y, u = problem.state("y", 1), problem.input("u", 1)
    problem.dynamics(y, increment=problem.dt * u)
    problem.residual("effort", u, weight=1e-3)
    valley = ca.vertcat(y * (y - 3), y / 3)
    problem.residual("valley", valley, weight=[1.0, 1.0], at="all")
    return problem.lower()


def guess_at(lowered: pq.Lowered, goal: float) -> pq.NamedArray:
    guess = lowered.trajectory()
    guess["y"] = np.linspace(1.5, goal, lowered.horizon + 1)[:, None]
    return guess


def test_keeps_the_better_of_two_minima(two_valleys: pq.Lowered) -> None:
    measured = two_valleys.knot()
    measured["y"] = 1.5
    guesses = [guess_at(two_valleys, goal) for goal in (3.0, 0.0)]
    params = two_valleys.parameters()
    choice = pq.Candidates(two_valleys, 2, threads=2).solve(params, measured, guesses)
    alone = [pq.Sqp(two_valleys).solve(params, measured, guess) for guess in guesses]
    assert [plan.cost for plan in choice.plans] == [plan.cost for plan in alone]
    assert choice.index == int(np.argmin([plan.cost for plan in alone]))
    assert choice.plan is choice.plans[choice.index]
    assert abs(alone[0].cost - alone[1].cost) > 0.1  # the minima do differ


def test_does_not_depend_on_the_number_of_threads(two_valleys: pq.Lowered) -> None:
    measured = two_valleys.knot()
    measured["y"] = 1.5
    guesses = [guess_at(two_valleys, goal) for goal in (3.0, 1.0, 0.0, -1.0)]
    params = two_valleys.parameters()
    results = [
        pq.Candidates(two_valleys, 4, threads=n).solve(params, measured, guesses) for n in (1, 2)
    ]
    assert np.array_equal(results[0].plan.xs, results[1].plan.xs)


@pytest.mark.parametrize(("at_most", "threads"), [(0, 1), (1, 0)])
def test_refuses_no_candidates(two_valleys: pq.Lowered, at_most: int, threads: int) -> None:
    with pytest.raises(pq.ProblemError, match="at least 1 is needed"):
        pq.Candidates(two_valleys, at_most, threads)


def test_refuses_more_guesses_than_solvers(two_valleys: pq.Lowered) -> None:
    guess = two_valleys.trajectory()
    with pytest.raises(pq.ProblemError, match="2 guesses; 1 to 1"):
        pq.Candidates(two_valleys, 1).solve(
            two_valleys.parameters(), two_valleys.knot(), [guess] * 2
        )
