"""A solve ends at its time limit with the best iterate, and says so."""

import casadi as ca
import numpy as np
import pytest

import palanquin as pq
from palanquin.problems.collection import COLLECTION


@pytest.fixture(autouse=True)
def cache(session_cache, monkeypatch):
    monkeypatch.setenv("PALANQUIN_CACHE", str(session_cache))


@pytest.fixture(scope="module")
def cart_pole(session_cache):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PALANQUIN_CACHE", str(session_cache))
        lowered = COLLECTION["cart_pole"].build().lower()
    return lowered, COLLECTION["cart_pole"].starts(lowered)["line"]


@pytest.mark.parametrize("seconds", [0.0, -1.0, np.inf, np.nan])
def test_a_limit_is_positive(cart_pole, seconds):
    with pytest.raises(ValueError, match=r"sqp\.max_seconds is .* finite and positive"):
        pq.Sqp(cart_pole[0], max_seconds=seconds)


def test_no_time_is_enough_for_one_full_step(cart_pole):
    """So that a plan answers to its measurement, however late it is."""
    lowered, (parameters, measured, guess) = cart_pole
    guess = guess.copy()
    guess.values[0] += 0.5
    for options in ({}, {"max_iterations": 1}):
        plan = pq.Sqp(lowered, max_seconds=1e-9, **options).solve(parameters, measured, guess)
        assert plan.iteration_count == 1
        one = pq.Sqp(lowered, max_iterations=1).solve(parameters, measured, guess)
        states = [b.name for b in lowered.core.blocks if b.is_state]
        for block in states:
            np.testing.assert_array_equal(plan.trajectory[block][0], measured[block])
        assert np.isfinite(plan.cost)
        if not options:
            assert plan.status is pq.Status.TIME_LIMIT
            assert "the time was up after 1 iterations" in plan.message
        if plan.iterations[0].step == "full":
            np.testing.assert_array_equal(plan.xs, one.xs)


def test_a_late_plan_is_usable_by_its_residuals(cart_pole):
    lowered, start = cart_pole
    for tolerance in (1e-9, 1e3):
        solver = pq.Sqp(lowered, max_seconds=1e-9, usable_violation=tolerance)
        plan = solver.solve(*start)
        assert plan.status is pq.Status.TIME_LIMIT
        worst = max(plan.equality_violation, plan.evaluation.hard_violation)
        assert plan.is_usable == (worst <= tolerance)


def test_a_limit_that_is_not_met_changes_nothing(cart_pole):
    lowered, start = cart_pole
    free = pq.Sqp(lowered).solve(*start)
    timed = pq.Sqp(lowered, max_seconds=1e3).solve(*start)
    np.testing.assert_array_equal(free.xs, timed.xs)
    assert free.status is timed.status


@pytest.mark.parametrize("share", [0.1, 0.3, 0.6, 0.9])
def test_the_best_iterate_is_returned(cart_pole, share):
    """Whenever the clock strikes, no iterate on the way was better."""
    lowered, start = cart_pole
    whole = pq.Sqp(lowered).solve(*start)
    seconds = share * whole.timings_ms["total"] / 1e3
    plan = pq.Sqp(lowered, max_seconds=seconds).solve(*start)
    assert plan.status in (pq.Status.TIME_LIMIT, whole.status)
    assert plan.iteration_count <= whole.iteration_count
    assert np.isfinite(plan.xs).all()
    at = lowered.evaluate(plan.trajectory, start.parameters, start.measured)
    assert at.cost == pytest.approx(plan.cost, rel=1e-12)
    worst = max(plan.equality_violation, plan.evaluation.hard_violation)
    own = plan.cost + 1e-6, worst
    for record in plan.iterations:
        other = record.cost + record.penalty, max(record.equality_max, record.inequality_max)
        assert not (other[0] < own[0] - 1e-3 and other[1] < own[1] - 1e-6)


def test_half_the_time_keeps_a_loop_going():
    """A pendulum with a hard bound in closed loop: the usual solve, then half of its time."""
    problem = pq.Problem(horizon=30, dt=0.05, name="deadline")
    x, u = problem.state("x", 2), problem.input("u", 1)
    problem.dynamics(x, increment=problem.dt * ca.vertcat(x[1], 9.81 * ca.sin(x[0]) + u))
    problem.residual("upright", x, at="all")
    problem.residual("effort", u, weight=1e-2)
    problem.inequality("torque", ca.vertcat(u, -u) - 5, policy=pq.Hard())
    lowered = problem.lower()
    parameters = lowered.parameters()

    def run(**options):
        rng = np.random.default_rng(1)
        solver = pq.Sqp(lowered, **options)
        knot, plans = lowered.knot(), []
        knot["x"] = [0.3, 0.0]
        guess = lowered.trajectory()
        for _ in range(40):
            plan = solver.solve(parameters, knot, guess)
            plans.append(plan)
            knot.values[:] = lowered.step(plan.xs[0], parameters.values[0])
            knot["x"] += [0, 0.05 * rng.normal()]
            guess = lowered.shift(plan.trajectory, parameters, 0.05)
        return plans, np.abs(knot["x"]).max()

    usual, end = run()
    assert end < 0.1
    seconds = np.median([plan.timings_ms["total"] for plan in usual]) / 2e3
    halved, end = run(max_seconds=seconds)
    assert [plan.message for plan in halved if not plan.is_usable] == []
    assert any(plan.status is pq.Status.TIME_LIMIT for plan in halved)
    assert end < 0.2


def test_ipopt_says_so_too(cart_pole):
    lowered, start = cart_pole
    plan = pq.Ipopt(lowered, penalize=True, max_seconds=1e-6).solve(*start)
    assert plan.status is pq.Status.TIME_LIMIT
