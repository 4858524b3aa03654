"""A measurement outside of hard bounds on states: no plan is lost for it, and the plan says so."""

import casadi as ca
import numpy as np
import pytest

import palanquin as pq


def cart(with_sum=False):
    """p+ = p + dt v, v+ = v + dt u with |u| <= 5 and p <= 1, all hard.

    `with_sum` adds p + v + u / 100 <= 3.
    """
    problem = pq.Problem(horizon=15, dt=0.1, name="cart")
    p, v, u = problem.state("p", 1), problem.state("v", 1), problem.input("u", 1)
    problem.dynamics(p, p + problem.dt * v)
    problem.dynamics(v, v + problem.dt * u)
    problem.residual("p", p - 0.9, at="all")
    problem.residual("v", v, weight=0.1, at="all")
    problem.residual("u", u, weight=0.01)
    problem.inequality("push", ca.vertcat(u - 5, -u - 5), pq.Hard())
    problem.inequality("wall", p - 1, pq.Hard(), at="all")
    if with_sum:
        problem.inequality("mixed", p + v + 0.01 * u - 3, pq.Hard())
    return problem.lower()


def at(lowered, p, v):
    knot = lowered.knot()
    knot["p"], knot["v"] = p, v
    return knot


def guess_of(lowered, knot):
    return np.tile(knot.values, (lowered.horizon + 1, 1))


@pytest.fixture(scope="module")
def lowered(session_cache):
    return cart()


@pytest.mark.parametrize("qp", ["structured", "osqp"])
@pytest.mark.parametrize("iterations", [1, 50])
@pytest.mark.parametrize(("outside", "said"), [(1e-6, "1e-06"), (0.05, "0.05"), (0.1, "0.1")])
def test_a_plan_starts_outside_of_a_bound(lowered, qp, iterations, outside, said):
    """It is at p = 1 + outside and moves back so fast that the next knot holds."""
    measured = at(lowered, 1.0 + outside, -1.5)
    sqp = pq.Sqp(lowered, qp=qp, max_iterations=iterations)
    plan = sqp.solve(lowered.parameters(), measured, guess_of(lowered, measured))
    assert plan.is_usable
    if iterations > 1 and qp == "structured":
        assert plan.status.name == "CONVERGED"
    assert plan.xs[0, 0] == 1.0 + outside
    assert plan.trajectory["p"][1:].max() <= 1 + 1e-4
    for word in ("wall", "measured", said):
        assert word in plan.message
    assert plan.violation["wall"] == pytest.approx(outside)
    if outside > 1e-5:  # what an OSQP leaves of other rows
        assert "wall" in plan.worst_rows(1)[0][0]


def test_a_measurement_within_bounds_is_not_mentioned(lowered):
    measured = at(lowered, 0.5, 0.0)
    plan = pq.Sqp(lowered).solve(lowered.parameters(), measured, guess_of(lowered, measured))
    assert plan.status.name == "CONVERGED"
    assert "measured" not in plan.message


def test_ipopt_is_asked_the_same(lowered):
    measured = at(lowered, 1.05, -1.0)
    start = lowered.parameters(), measured, guess_of(lowered, measured)
    reference, plan = pq.Ipopt(lowered).solve(*start), pq.Sqp(lowered).solve(*start)
    assert reference.status.name == "CONVERGED"
    np.testing.assert_allclose(plan.cost, reference.cost, rtol=1e-6)


def test_rows_over_inputs_are_asked_at_the_first_knot(session_cache):
    """p + v + u / 100 <= 3 at 1 + 1.98: u is at most 2 there, though the cost may want more."""
    lowered = cart(with_sum=True)
    measured = at(lowered, 0.9, 2.08)
    plan = pq.Sqp(lowered, max_iterations=1).solve(
        lowered.parameters(), measured, guess_of(lowered, measured)
    )
    assert plan.trajectory["u"][0] <= 2.0 + 1e-4


@pytest.mark.parametrize("two_phases", [False, True])
def test_a_loop_goes_on_through_measurements_outside(lowered, two_phases):
    """The wall is 0.05 too far away in every third measurement."""
    sqp = pq.Sqp(lowered, max_iterations=1)
    p = lowered.parameters()
    knot = at(lowered, 0.0, 0.0)
    guess, outside = lowered.wrap(guess_of(lowered, knot)), 0
    for step in range(40):
        measured = knot.copy()
        measured["p"] += 0.15 * (step % 3 == 2)
        if two_phases:
            assert sqp.prepare(p, knot, guess)
            plan = sqp.feedback(measured)
        else:
            plan = sqp.solve(p, measured, guess)
        np.testing.assert_array_equal(plan.xs[0, :2], measured.values[:2])
        is_outside = measured["p"][0] > 1 + 1e-6
        outside += is_outside
        assert ("wall" in plan.message) == is_outside or not plan.is_usable
        assert plan.status.name not in ("QP_FAILED", "INFEASIBLE", "DIVERGED", "NON_FINITE")
        guess = lowered.shift(plan.trajectory, p, 0.1)
        knot = lowered.wrap(lowered.step(plan.xs[0], p.values[0]))
    assert outside >= 5
