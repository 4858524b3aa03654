"""What the SQP says at the end, and that it is so: minima, saddles, bottomless costs,
contradictions, and feasible problems whose first linearisation has no solution."""

import casadi as ca
import numpy as np
import pytest

import palanquin as pq
from palanquin.problems.collection import COLLECTION


def solve(lowered, guess=None, **options):
    start = lowered.trajectory() if guess is None else guess
    return pq.Sqp(lowered, **options).solve(lowered.parameters(), lowered.knot(), start)


def scalar_problem(name, cost=None, **blocks):
    """x+ = x + dt u over 4 intervals, with `cost(problem, x, u)` stating the rest."""
    problem = pq.Problem(horizon=4, dt=0.1, name=name)
    x, u = problem.state("x", 1), problem.input("u", 1)
    problem.dynamics(x, increment=problem.dt * u)
    cost(problem, x, u)
    return problem.lower()


# ---- damping ------------------------------------------------------------------------------------


def test_gauss_newton_reaches_a_point_from_anywhere():
    """Large residuals, where undamped Gauss-Newton steps run to and fro."""
    ocp = COLLECTION["unicycle"]
    lowered = ocp.build().lower()
    solver = pq.Sqp(lowered, max_iterations=100)
    plans = [solver.solve(*start) for start in ocp.starts(lowered, random=40).values()]
    assert [plan.status for plan in plans] == [pq.Status.CONVERGED] * 42
    best = min(plan.cost for plan in plans)
    assert best == pytest.approx(7.4857442, rel=1e-6)
    # Some end in the optimum that comes round from the other side.
    assert sum(plan.cost < best * (1 + 1e-6) for plan in plans) >= 36


@pytest.mark.parametrize("qp", ["structured", "ldl"])
def test_an_input_in_no_cost_is_damped_to_the_optimum(qp):
    """Only the end counts, and both inputs push alike: the Hessian is singular."""
    problem = pq.Problem(horizon=6, dt=0.2, name="end_alone")
    x, u = problem.state("x", 1), problem.input("u", 2)
    problem.dynamics(x, increment=problem.dt * (ca.sin(u[0]) + u[1]))
    problem.residual("end", x - 3, at="terminal")
    lowered = problem.lower()
    plan = solve(lowered, qp=qp)
    assert plan.status is pq.Status.CONVERGED, plan.message
    assert plan.cost < 1e-9
    assert plan.trajectory["x"][-1] == pytest.approx(3, abs=1e-4)


def test_damping_is_no_part_of_well_behaved_problems():
    ocp = COLLECTION["carrying"]
    lowered = ocp.build().lower()
    plan = pq.Sqp(lowered).solve(*ocp.starts(lowered)["line"])
    assert plan.status is pq.Status.CONVERGED
    assert all(record.damping == 0 and record.step == "full" for record in plan.iterations)
    assert plan.iterations[-1].stationarity <= 1e-5


# ---- exact Hessians -----------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["unicycle", "unicycle_arrival"])
def test_exact_hessians_end_quadratically_where_stages_are_indefinite(name):
    ocp = COLLECTION[name]
    lowered = ocp.build().lower()
    plan = pq.Sqp(lowered, hessian="exact", max_iterations=100).solve(*ocp.starts(lowered)["line"])
    assert plan.status is pq.Status.CONVERGED, plan.message
    last = np.abs([record.predicted for record in plan.iterations[-3:]])
    assert last[-1] < 1e-3 * last[-2] or last[-1] < 1e-12
    assert not plan.iterations[-1].convexified


def two_valleys(problem, x, u):
    problem.cost("valleys", (u**2 - 1) ** 2)
    problem.residual("state", x, weight=1e-3, at="all")


def test_a_saddle_is_not_called_a_minimum():
    lowered = scalar_problem("two_valleys", two_valleys)
    top = solve(lowered, hessian="exact")
    assert top.status is pq.Status.SADDLE, top.message
    assert "no minimum" in top.message
    guess = lowered.trajectory()
    guess["u"] = [[0.3], [-0.2], [0.4], [-0.5], [0.0]]
    valley = solve(lowered, guess, hessian="exact")
    assert valley.status is pq.Status.CONVERGED, valley.message
    np.testing.assert_allclose(np.abs(valley.trajectory["u"][:4]), 1, atol=1e-2)


@pytest.mark.parametrize(("power", "hessian"), [(1, "gauss_newton"), (1, "exact"), (2, "exact")])
def test_a_bottomless_cost_is_said_so(power, hessian):
    def falling(problem, x, u):
        problem.cost("fall", -(u**power))

    lowered = scalar_problem(f"bottomless_{power}", falling)
    guess = lowered.trajectory()
    guess["u"] = 0.5
    plan = solve(lowered, guess, hessian=hessian, max_iterations=200)
    assert plan.status is pq.Status.UNBOUNDED, plan.message
    assert not plan.is_usable


# ---- rows ---------------------------------------------------------------------------------------


def test_a_bad_linearisation_does_not_lose_a_feasible_problem():
    """A car at rest cannot move sideways to first order: the first QP has no solution."""
    ocp = COLLECTION["unicycle_arrival"]
    lowered = ocp.build().lower()
    plan = pq.Sqp(lowered, max_iterations=200).solve(*ocp.starts(lowered)["rest"])
    assert plan.iterations[0].step == "restored"
    assert plan.status is pq.Status.CONVERGED, plan.message
    assert plan.cost == pytest.approx(2.8973110339, rel=1e-6)


def test_infeasible_is_proved_and_named():
    """x_N^2 = -1 has no solution; its violation is least at x_N = 0."""

    def contradiction(problem, x, u):
        problem.residual("effort", u)
        problem.equality("square", x**2 + 1, at="terminal", robot="left")

    lowered = scalar_problem("no_root", contradiction)
    guess = lowered.trajectory()
    guess["u"], guess["x"] = 1.0, np.linspace(0.0, 0.4, 5)[:, None]
    plan = solve(lowered, guess, max_iterations=200)
    assert plan.status is pq.Status.INFEASIBLE, plan.message
    assert "square (robot left, row 0, knot 4)" in plan.message
    assert plan.trajectory["x"][-1] == pytest.approx(0, abs=1e-2)
    assert plan.worst_rows(1)[0][1] == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize("kind", ["circle", "obstacle"])
@pytest.mark.parametrize("target", [0.0, 0.1])
def test_a_maximum_of_the_violation_is_left(kind, target):
    """From the centre of a circle that is to be reached, or left: no direction is better to first
    order, which is no proof that there is none."""
    problem = pq.Problem(horizon=10, dt=0.1, name=kind)
    x, u = problem.state("x", 2), problem.input("u", 2)
    problem.dynamics(x, increment=problem.dt * u)
    problem.residual("effort", u - target)
    if kind == "circle":
        problem.equality("on_circle", ca.sumsqr(x) - 1, at="terminal")
    else:
        problem.inequality("off_disc", 1 - ca.sumsqr(x), policy=pq.Hard(), at="terminal")
    plan = solve(problem.lower())
    assert plan.status is pq.Status.CONVERGED, plan.message
    assert np.linalg.norm(plan.trajectory["x"][-1]) == pytest.approx(1, abs=1e-6)
    # To go 1 in the time 1 by inputs of length 1, along the target.
    assert plan.cost == pytest.approx(10 * (1 - np.sqrt(2) * target) ** 2, rel=1e-6)


def test_a_real_time_step_out_of_bounds_comes_back():
    """Hard |v| <= 1 and |u| <= 1, pushed to v = 1.3: no plan can hold the bound at once."""
    problem = pq.Problem(horizon=12, dt=0.1, name="pushed_out")
    v, u = problem.state("v", 1), problem.input("u", 1)
    problem.dynamics(v, increment=problem.dt * u)
    problem.residual("speed", v - 0.9, at="all")
    problem.residual("effort", u, weight=1e-2)
    problem.inequality("speed_limit", ca.vertcat(v - 1, -v - 1), policy=pq.Hard(), at="all")
    problem.inequality("force_limit", ca.vertcat(u - 1, -u - 1), policy=pq.Hard())
    lowered = problem.lower()
    solver = pq.Sqp(lowered, qp="multipliers", max_iterations=1)
    guess, measured = lowered.trajectory(), lowered.knot()
    measured["v"] = 1.3
    for step in range(8):
        assert solver.prepare(lowered.parameters(), guess.values[0], guess)
        plan = solver.feedback(measured)
        assert plan.is_usable, plan.message
        assert plan.trajectory["v"][0] == measured["v"]
        push = plan.trajectory["u"][0, 0]
        if step < 2:
            assert push == pytest.approx(-1, abs=0.2)  # both limits give way a little
        measured["v"] = measured["v"] + 0.1 * np.clip(push, -1, 1)
        guess = plan.trajectory.copy()
    assert measured["v"] < 1.0 + 1e-3


# ---- what may be executed -----------------------------------------------------------------------


@pytest.mark.parametrize("max_iterations", [1, 2])
def test_a_plan_that_breaks_its_dynamics_is_not_usable(max_iterations):
    def far(problem, x, u):
        problem.residual("effort", u)
        problem.equality("square", x**2 - 1e4, at="terminal")

    lowered = scalar_problem("far_square", far)
    guess = lowered.trajectory()
    guess["x"] = 1.0
    plan = solve(lowered, guess, max_iterations=max_iterations)
    assert plan.equality_violation > 10
    assert not plan.is_usable


def test_nothing_is_claimed_of_a_solve_that_did_not_start():
    def logarithm(problem, x, u):
        problem.residual("effort", ca.log(u))

    lowered = scalar_problem("logarithm", logarithm)
    guess = lowered.trajectory()
    guess["u"] = -1.0
    plan = solve(lowered, guess)
    assert plan.status is pq.Status.NON_FINITE
    assert np.isnan(plan.cost)
    assert np.isnan(plan.equality_violation)
    assert not plan.is_usable
