"""The ladder's events: which rung was taken, when, and why."""

from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import brentq

import palanquin as pq
from palanquin.events import Event, EventKind, count_events, plan_events

pytestmark = pytest.mark.bindings

OFFSET = 0.05
# A filter that refuses nothing leaves the cycle to its own guard.
LOOSE = {"cost_resolution": 10.0}


def newton(u):
    """One Gauss-Newton step for min (atan(u) + OFFSET)^2."""
    return u - (np.arctan(u) + OFFSET) * (1.0 + u**2)


@pytest.fixture(scope="module")
def overshooting(tmp_path_factory):
    """Gauss-Newton steps on an arc tangent overshoot: from one point they lead to and fro."""
    problem = pq.Problem(horizon=1, dt=0.1, name="overshooting")
    x, u = problem.state("x", 1), problem.input("u", 1)
    problem.dynamics(x, increment=0 * x)
    problem.residual("state", x, at="all")
    problem.residual("angle", ca.atan(u) + OFFSET)
    lowered = problem.lower()
    guess = lowered.trajectory()
    guess["u"][0] = brentq(lambda u: newton(newton(u)) - u, 1.0, 2.0, xtol=1e-15)
    return lowered, guess


def solve(overshooting, **options):
    lowered, guess = overshooting
    solver = pq.Sqp(lowered, line_search=LOOSE, max_iterations=20, **options)
    return solver.solve(lowered.parameters(), lowered.knot(), guess)


def test_a_cycle_is_refused_and_left(overshooting):
    plan = solve(overshooting)
    assert plan.status is pq.Status.CONVERGED
    assert plan.trajectory["u"][0] == pytest.approx(np.tan(-OFFSET), abs=1e-6)
    assert [record.refused_cycle for record in plan.iterations[:3]] == [False, False, True]
    refused, damped = plan_events(plan, 1.5)[:2]
    assert (refused.time, refused.kind) == (1.5, EventKind.REFUSED_CYCLE)
    assert "iteration 3" in refused.reason
    assert damped.kind is EventKind.DAMPED_STEP


def test_without_the_guard_the_cycle_goes_on(overshooting):
    plan = solve(overshooting, globalize=False)
    costs = [record.cost for record in plan.iterations[:6]]
    np.testing.assert_allclose(costs[2:], costs[:-2], rtol=1e-6)
    assert abs(costs[1] - costs[0]) > 1e-3


def fake_plan(*steps, is_usable=True, message=""):
    records = [
        SimpleNamespace(
            step=step, step_length=0.25, refused_cycle=False, fell_back=False, damping=0.0,
            convexified=False,
        )
        for step in steps
    ]  # fmt: skip
    return SimpleNamespace(iterations=records, is_usable=is_usable, message=message)


def test_full_steps_are_no_events():
    assert plan_events(fake_plan("full", "full"), 0.0) == ()


def test_every_rung_has_its_kind_and_reason():
    steps = "damped", "regularized", "restored", "rejected"
    plan = fake_plan(*steps, is_usable=False, message="stalled here")
    kinds = [
        EventKind.DAMPED_STEP,
        EventKind.REGULARIZED_STEP,
        EventKind.RESTORED_STEP,
        EventKind.KEPT_PLAN,
    ]
    events = plan_events(plan, 0.3)
    assert [event.kind for event in events] == kinds
    assert events[0].reason == "iteration 1: step length 0.25"
    assert events[3] == Event(0.3, EventKind.KEPT_PLAN, "stalled here")


def test_a_solve_that_did_not_start_keeps_the_plan():
    (event,) = plan_events(fake_plan(is_usable=False, message="the guess is not finite"), 0.0)
    assert event == Event(0.0, EventKind.KEPT_PLAN, "the guess is not finite")


def test_counts_name_every_kind():
    counts = count_events([Event(0.0, EventKind.RESTART, "")] * 2)
    assert list(counts) == [kind.value for kind in EventKind]
    assert counts["restart"] == 2
    assert sum(counts.values()) == 2
