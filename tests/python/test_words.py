"""Words that modellers expect: bounds, constants, rates, free states, slacks, integrators."""

import casadi as ca
import numpy as np
import pytest

import palanquin as pq
from palanquin.integrators import TABLEAUS, integrate

FORMS = [
    ("structured", {}), ("ldl", {}), ("osqp", {}),
    ("structured", {"form": "paper"}), ("structured", {"hessian": "exact"}),
]  # fmt: skip


@pytest.fixture(autouse=True)
def cache(session_cache, monkeypatch):
    monkeypatch.setenv("PALANQUIN_CACHE", str(session_cache))


def solve_everywhere(lowered, parameters=None, measured=None, guess=None, forms=FORMS, **ipopt):
    """The plan, after all back ends and forms have found the same cost as Ipopt."""
    parameters = lowered.parameters() if parameters is None else parameters
    measured = lowered.knot() if measured is None else measured
    reference = pq.Ipopt(lowered, **{"penalize": True, **ipopt}).solve(parameters, measured, guess)
    assert reference.status is pq.Status.CONVERGED, reference.message
    plans = []
    has_hard_rows = pq.Hard() in lowered.policies.values()
    for qp, options in forms:
        if qp == "ldl" and has_hard_rows:
            continue  # which it does not take
        solver = pq.Sqp(lowered, qp=qp, max_iterations=200, **options)
        plan = solver.solve(parameters, measured, guess)
        assert plan.status is pq.Status.CONVERGED, (qp, options, plan.message)
        assert plan.cost == pytest.approx(reference.cost, rel=1e-6, abs=1e-8), (qp, options)
        plans.append(plan)
    return plans[0]


def cart(name, horizon=10):
    problem = pq.Problem(horizon=horizon, dt=0.1, name=name)
    x, u = problem.state("x", 2), problem.input("u", 1)
    problem.ode(x, ca.vertcat(x[1], u))
    problem.residual("effort", u, weight=0.1)
    return problem, x, u


# ---- bounds --------------------------------------------------------------------------------------


def test_a_box_is_its_rows():
    by_word, by_hand = cart("by-word"), cart("by-hand")
    for problem, x, _ in (by_word, by_hand):
        problem.residual("goal", x - ca.vertcat(1, 0), at="all")
    problem, x, u = by_word
    problem.bound("push", u, -2, 1.5)
    problem.bound("box", x, lower=[-np.inf, -0.5], upper=[0.8, np.inf], at="all")
    problem, x, u = by_hand
    problem.inequality("push", ca.vertcat(u - 1.5, -2 - u), pq.Hard())
    problem.inequality("box", ca.vertcat(x[0] - 0.8, -0.5 - x[1]), pq.Hard(), at="all")
    plans = []
    for problem, *_ in (by_word, by_hand):
        lowered = problem.lower()
        plans.append(pq.Sqp(lowered).solve(lowered.parameters(), lowered.knot()))
    np.testing.assert_allclose(plans[0].xs, plans[1].xs, rtol=0, atol=1e-9)
    assert plans[0].trajectory["u"].max() == pytest.approx(1.5)
    assert max(plans[0].violation.values()) < 1e-8


@pytest.mark.parametrize(
    ("lower", "upper", "message"),
    [
        (None, None, "neither lower nor upper"),
        (-np.inf, np.inf, "neither lower nor upper"),
        (2, 1, "entry 0 has lower 2 above upper 1"),
        ([0, 0, 0], 1, "lower has 3 entries; 1 or 2 are needed"),
        (0, np.nan, "upper is not a number"),
    ],
)
def test_bounds_that_bound_nothing_or_everything_are_refused(lower, upper, message):
    problem, x, _ = cart("refused")
    with pytest.raises(pq.ProblemError, match=message):
        problem.bound("box", x, lower, upper)


def test_bounds_take_expressions_and_policies():
    problem, _x, u = cart("soft")
    limit = problem.parameter("limit", default=0.3)
    problem.residual("goal", u - 1)
    problem.bound("push", u, -limit, limit, policy=pq.SquaredHinge(1e6))
    lowered = problem.lower()
    parameters = lowered.parameters()
    for value in (0.3, 0.6):
        parameters["limit"] = value
        plan = pq.Sqp(lowered).solve(parameters, lowered.knot())
        assert plan.trajectory["u"][0, 0] == pytest.approx(value, abs=1e-4)


# ---- constants, rates ----------------------------------------------------------------------------


def test_a_constant_is_decided_with_the_trajectory():
    """Rest to rest over 1 with a force of 1 takes 2 s; and its terminal value may have a price."""
    problem = pq.Problem(horizon=20, dt=1.0, name="bang")
    p, v, u = problem.state("p", 1), problem.state("v", 1), problem.input("u", 1)
    duration = problem.constant("duration", lower=0.1, upper=10)
    h = duration / problem.horizon
    problem.dynamics(p, p + h * v + h**2 / 2 * u)
    problem.dynamics(v, v + h * u)
    problem.bound("force", u, -1, 1)
    problem.equality("arrival", ca.vertcat(p - 1, v), at="terminal")
    problem.cost("duration", problem.before(duration)[0], at="terminal")
    lowered = problem.lower()
    guess = lowered.trajectory()
    guess["duration"] = 3.0
    plan = pq.Ipopt(lowered).solve(lowered.parameters(), lowered.knot(), guess)
    assert plan.cost == pytest.approx(2.0, rel=1e-6)
    sqp = pq.Sqp(lowered, max_iterations=200).solve(lowered.parameters(), lowered.knot(), guess)
    assert sqp.status is pq.Status.CONVERGED, sqp.message
    assert sqp.cost == pytest.approx(2.0, rel=1e-6)
    np.testing.assert_allclose(sqp.trajectory["duration"][:-1], 2.0, rtol=1e-6)


def test_rates_have_limits_and_prices():
    problem, x, u = cart("rates")
    problem.residual("goal", x - ca.vertcat(1, 0), at="all")
    problem.bound("jerk", problem.rate(u), -5, 5)
    problem.residual("smooth", problem.rate(u), weight=1e-3)
    lowered = problem.lower()
    measured = lowered.knot()
    measured["u.before"] = 0.2
    plan = solve_everywhere(lowered, measured=measured)
    u = np.concatenate([[0.2], plan.trajectory["u"][:-1, 0]])
    assert np.abs(np.diff(u)).max() == pytest.approx(0.5, abs=1e-6)
    np.testing.assert_allclose(plan.trajectory["u.before"][1:, 0], u[1:])


def test_before_is_for_blocks_without_dynamics():
    problem, x, u = cart("before")
    with pytest.raises(pq.ProblemError, match="it is a state"):
        problem.before(x)
    assert ca.is_equal(problem.before(u), problem.before(u))


# ---- free initial states -------------------------------------------------------------------------


def estimation(initial="free"):
    """A decaying oscillator is seen by its position; where it began is not known."""
    problem = pq.Problem(horizon=12, dt=0.2, name=f"estimation-{initial}")
    x, w = problem.state("x", 2, initial=initial), problem.input("w", 1)
    seen = problem.parameter("seen")
    problem.ode(x, ca.vertcat(x[1], -2 * ca.sin(x[0]) - 0.1 * x[1] + w))
    problem.residual("noise", w, weight=100)
    problem.residual("seen", x[0] - seen, at="all", weight=10)
    problem.residual("prior", x - 0.1, weight=1e-3 * problem.first_knot)
    return problem.lower()


def test_the_first_state_is_found():
    lowered = estimation()
    truth, parameters = np.array([0.8, -0.3]), lowered.parameters()
    parameters["seen"] = 0.0
    z = lowered.knot()
    z["x"] = truth
    for k in range(len(parameters.values)):
        parameters["seen"][k] = z["x"][0]
        z.values[:] = lowered.step(z, parameters.values[0])
    plan = solve_everywhere(lowered, parameters)
    np.testing.assert_allclose(plan.trajectory["x"][0], truth, atol=5e-3)
    # What was measured plays no part, whatever the guess.
    measured, guess = lowered.knot(), lowered.trajectory()
    measured["x"], guess["x"] = [5.0, -7.0], 0.5
    again = pq.Sqp(lowered).solve(parameters, measured, guess)
    np.testing.assert_allclose(again.xs, plan.xs, atol=1e-6)
    # A real-time step in two phases does not put it there either.
    two = pq.Sqp(lowered)
    assert two.prepare(parameters, measured, plan.trajectory)
    np.testing.assert_allclose(two.feedback(measured).xs, plan.xs, atol=1e-6)


def test_free_and_measured_states_go_together():
    """A mass of unknown speed at a known place, on its way to a goal, and a quaternion beside."""
    problem = pq.Problem(horizon=8, dt=0.25, name="launch")
    q, p = problem.quaternion_state("q"), problem.state("p", 2)
    v, u = problem.state("v", 2, initial="free"), problem.input("u", 2)
    problem.dynamics(q, increment=problem.dt * ca.vertcat(u, 0.1))
    problem.ode([p, v], [v, u + ca.vertcat(0, -1) - 0.2 * v * ca.norm_2(v + 1e-3)])
    problem.residual("effort", ca.vertcat(u, 0.1 * v))
    problem.equality("arrival", p - ca.DM([2, 1]), at="terminal")
    problem.bound("speed", v[0], upper=1.1, active=problem.first_knot)
    lowered = problem.lower()
    measured = lowered.knot()
    measured["p"], measured["v"] = [0.1, 0.2], [9.0, 9.0]
    plan = solve_everywhere(lowered, measured=measured, forms=FORMS[:4])
    np.testing.assert_array_equal(plan.trajectory["p"][0], [0.1, 0.2])
    assert plan.trajectory["v"][0, 0] == pytest.approx(1.1, abs=1e-6)
    assert pq.Sqp(lowered).lowered.check().is_ok


def test_a_word_for_the_initial_state_must_be_known():
    with pytest.raises(pq.ProblemError, match="measured or free"):
        pq.Problem(horizon=2, dt=0.1).state("x", 1, initial="unknown")


# ---- slacks --------------------------------------------------------------------------------------


def corridor(policy, at="running"):
    """A mass that flies out of its corridor p <= 1; its price says how far."""
    problem, x, u = cart("corridor", horizon=15)
    problem.residual("state", x, weight=[0.1, 0.01], at="all")
    problem.inequality("corridor", x[0] - 1, policy, at=at)
    problem.bound("push", u, -1, 1)
    lowered = problem.lower()
    measured = lowered.knot()
    measured["x"] = [1.1, 0.6]
    return lowered, measured


@pytest.mark.parametrize("at", ["running", "all", "terminal"])
@pytest.mark.parametrize("slack", [pq.Slack(l1=2.0, l2=3.0), pq.Slack(l1=0.7)], ids=str)
def test_slacks_are_what_the_rows_exceed(slack, at):
    lowered, measured = corridor(slack, at)
    plan = solve_everywhere(lowered, measured=measured, forms=FORMS[:1])
    p = plan.trajectory["x"][:, 0]
    beyond = np.maximum(p - 1, 0)
    price = slack.l1 * beyond + slack.l2 * beyond**2
    stays = at != "terminal"
    if stays:
        np.testing.assert_allclose(
            plan.trajectory["corridor.slack"][:-1, 0], beyond[:-1], atol=1e-6
        )
    total = price[:-1].sum() * stays + price[-1] * (at != "running")
    u, x = plan.trajectory["u"][:-1], plan.trajectory["x"]
    own = 0.1 * (u**2).sum() + (x**2 @ [0.1, 0.01]).sum()
    assert plan.cost == pytest.approx(own + total, rel=1e-6)


def test_a_high_price_makes_the_row_hard_and_a_low_one_is_its_multiplier():
    costs = {}
    for name, policy in (("hard", pq.Hard()), ("high", pq.Slack(l1=50)), ("low", pq.Slack(l1=0.5))):
        problem, x, _ = cart(f"priced-{name}")
        problem.residual("goal", x - ca.vertcat(1, 0), at="all")
        problem.inequality("slow", x[1] - 0.2, policy)
        lowered = problem.lower()
        plan = pq.Sqp(lowered).solve(lowered.parameters(), lowered.knot())
        assert plan.status is pq.Status.CONVERGED, plan.message
        costs[name] = plan
    assert costs["high"].cost == pytest.approx(costs["hard"].cost, rel=1e-7)
    hard = np.nanmax(costs["hard"].multipliers["slow"])
    assert 0.5 < hard < 50
    low = costs["low"].multipliers["slow"][:-1, 0]
    assert low.max() == pytest.approx(0.5, abs=1e-6)


def test_a_quadratic_slack_is_a_squared_hinge():
    plans = []
    for policy in (pq.Slack(l2=7.0), pq.SquaredHinge(7.0)):
        lowered, measured = corridor(policy, "all")
        plans.append(pq.Sqp(lowered).solve(lowered.parameters(), measured))
    np.testing.assert_array_equal(plans[0].xs, plans[1].xs)
    assert lowered.policies["corridor"] == pq.SquaredHinge(7.0)


@pytest.mark.parametrize(
    ("prices", "message"),
    [((0, 0), "l1 or l2 must be positive"), ((-1, 0), "Slack.l1 is -1"), ((1, np.inf), "Slack.l2")],
)
def test_prices_of_slacks_have_rules(prices, message):
    with pytest.raises(pq.ProblemError, match=message):
        pq.Slack(*prices)


def test_owners_of_a_family_have_slacks_of_their_own():
    problem, x, _u = cart("owners")
    for robot in ("left", "right"):
        problem.inequality("slow", x[1] - 0.1, pq.Slack(l1=1.0), robot=robot)
    names = [b.name for b in problem.blocks]
    assert "slow.slack" in names
    assert "slow.slack2" in names
    lowered = problem.lower()
    measured = lowered.knot()
    measured["x"] = [0, 1]
    plan = pq.Sqp(lowered).solve(lowered.parameters(), measured)
    owners = {r.robot for r in plan.rows() if r.constraint == "slow"}
    assert owners == {"left", "right"}


# ---- integrators ---------------------------------------------------------------------------------

ORDERS = {
    "euler": 1, "midpoint": 2, "rk4": 4,
    "implicit_euler": 1, "implicit_midpoint": 2, "gauss_legendre": 4, "radau": 3,
}  # fmt: skip


def van_der_pol(x):
    return ca.vertcat(x[1], (1 - x[0] ** 2) * x[1] - x[0])


def after(integrator, steps, rate=van_der_pol, start=(1.0, 0.5), duration=1.0):
    x = ca.SX.sym("x", len(start))
    step = ca.Function("f", [x], [integrate(rate, x, duration / steps, integrator, 1)])
    for _ in range(steps):
        start = step(start)
    return np.array(start).ravel()


def test_steps_follow_each_other():
    x = ca.SX.sym("x", 2)
    two = ca.Function("f", [x], [integrate(van_der_pol, x, 0.5, "implicit_midpoint", 2)])
    by_ones = after("implicit_midpoint", 2, duration=0.5)
    np.testing.assert_allclose(np.array(two([1.0, 0.5])).ravel(), by_ones, rtol=0, atol=1e-14)


@pytest.mark.parametrize("integrator", TABLEAUS)
def test_orders(integrator):
    exact = after("gauss_legendre", 60)
    coarse, fine = (np.abs(after(integrator, n) - exact).max() for n in (8, 16))
    assert np.log2(coarse / fine) == pytest.approx(ORDERS[integrator], abs=0.35)


@pytest.mark.parametrize("integrator", [n for n, t in TABLEAUS.items() if not t.is_explicit])
def test_implicit_equations_are_solved(integrator):
    """The stages k_i = rate(x + h sum a_ij k_j), found by fixed-point iteration instead."""
    tableau, h, x = TABLEAUS[integrator], 0.1, np.array([1.0, 0.5])
    rate = ca.Function("r", [v := ca.SX.sym("v", 2)], [van_der_pol(v)])
    k = np.zeros((len(tableau.b), 2))
    for _ in range(100):
        k = np.array([np.array(rate(x + h * (row @ k))).ravel() for row in tableau.a])
    expected = x + h * tableau.b @ k
    np.testing.assert_allclose(after(integrator, 1, duration=h), expected, rtol=0, atol=1e-13)


@pytest.mark.parametrize("integrator", ["implicit_euler", "implicit_midpoint", "radau"])
def test_stiff_equations_stay_bounded(integrator):
    def rate(x):
        return ca.vertcat(-1000 * (x[0] - ca.cos(x[1])), 1)

    x = after(integrator, 10, rate, start=(1.5, 0.0))
    assert abs(x[0]) < 2
    if integrator != "implicit_midpoint":  # which is A-stable, but damps nothing out
        assert x[0] == pytest.approx(np.cos(1), abs=2e-3)


@pytest.mark.parametrize("integrator", ["rk4", "gauss_legendre", "radau"])
def test_derivatives_of_integrated_dynamics(integrator):
    problem = pq.Problem(horizon=5, dt=0.1, name=f"ode-{integrator}")
    x, v, u = problem.state("x", 2), problem.state("v", 1), problem.input("u", 1)
    steps = 2 if integrator == "rk4" else 1  # Newton's iterations make long functions
    problem.ode([x, v], [ca.vertcat(v, ca.sin(x[0]) + u), -x[1] * v], integrator, steps=steps)
    problem.residual("all", ca.vertcat(x, v, u))
    report = problem.check()
    assert report.is_ok, str(report)
    assert not report.findings, str(report)


def test_what_ode_refuses():
    problem = pq.Problem(horizon=5, dt=0.1)
    x, q = problem.state("x", 2), problem.quaternion_state("q")
    with pytest.raises(pq.ProblemError, match="integrator is 'rk5'; it must be one of euler"):
        problem.ode(x, x, "rk5")
    with pytest.raises(pq.ProblemError, match="2 states have 1 rates"):
        problem.ode([x, q], [x])
    with pytest.raises(pq.ProblemError, match="'q' is a quaternion"):
        problem.ode(q, q)
    with pytest.raises(pq.ProblemError, match="rate of 'x' has 1 rows; 2 are needed"):
        problem.ode(x, x[0])
    with pytest.raises(pq.ProblemError, match="integrator steps is 0"):
        problem.ode(x, x, steps=0)
