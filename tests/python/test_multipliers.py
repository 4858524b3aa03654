"""Plans carry the multipliers of all rows by name; infeasible ones a certificate; NaN its place."""

import pickle

import casadi as ca
import numpy as np
import pytest
from support.small_problems import LIBRARY

import palanquin as pq
from palanquin import _core


@pytest.fixture(autouse=True)
def cache(session_cache, monkeypatch):
    monkeypatch.setenv("PALANQUIN_CACHE", str(session_cache))


# ---- multipliers ---------------------------------------------------------------------------------


def assert_same_multipliers(plan, reference, tolerance=2e-4):
    compared = set(plan.multipliers) & set(reference.multipliers)
    assert {
        name for name in plan.multipliers if not name.endswith((".carried", ".chart"))
    } <= compared
    for name in compared:
        a, b = plan.multipliers[name], reference.multipliers[name]
        assert a.shape == b.shape, name
        assert np.array_equal(np.isnan(a), np.isnan(b)), name
        scale = max(1.0, np.nanmax(np.abs(b), initial=0.0))
        np.testing.assert_allclose(a, b, rtol=0, atol=tolerance * scale, err_msg=name)


@pytest.mark.parametrize("name", LIBRARY)
def test_multipliers_are_ipopts(name, lowered):
    problem = LIBRARY[name]
    inputs = problem.inputs(lowered(name))
    reference = pq.Ipopt(lowered(name), penalize=True).solve(*inputs)
    for qp in ("structured",) if problem.has_hard_rows else ("structured", "ldl"):
        plan = pq.Sqp(lowered(name), qp=qp, cost_tolerance=1e-13).solve(*inputs)
        assert plan.status is pq.Status.CONVERGED, plan.message
        assert_same_multipliers(plan, reference)


def cart(name="cart", hard=True, **rows):
    """A cart with a bound on its push, a limit of its rate, and an arrival."""
    problem = pq.Problem(horizon=6, dt=0.2, name=name)
    x, u = problem.state("x", 2), problem.input("u", 1)
    problem.dynamics(x, increment=problem.dt * ca.vertcat(x[1], u))
    problem.residual("effort", u, at="running")
    change = problem.input("change", 1)
    problem.link("rate", change - (u - problem.previous(u)))
    problem.residual("change", change, weight=0.1)
    policy = pq.Hard() if hard else pq.Penalty(50.0)
    problem.inequality("push", u - 1.3, policy=policy, robot="left", limb="LF")
    problem.inequality("push", -u - 1.3, policy=policy, robot="right")
    problem.equality("arrival", x - ca.vertcat(0.45, 0.0), at="terminal")
    for row, expression in rows.items():
        problem.equality(row, expression(x, u), at="terminal")
    return problem.lower()


@pytest.mark.parametrize("qp", ["structured", "osqp"])
def test_hard_and_link_rows_have_ipopts_multipliers(qp):
    lowered = cart()
    inputs = lowered.parameters(), lowered.knot()
    reference = pq.Ipopt(lowered).solve(*inputs)
    plan = pq.Sqp(lowered, qp=qp).solve(*inputs)
    assert_same_multipliers(plan, reference, 2e-3 if qp == "osqp" else 2e-4)
    push = plan.multipliers["push"]
    assert push.shape == (7, 2)
    assert np.isnan(push[-1]).all()
    assert (push[:-1] > -1e-9).all()
    assert push[:-1].max() > 0.01  # a bound is active
    assert np.isfinite(plan.multipliers["rate"][:-1]).all()


def test_multipliers_are_prices():
    """The optimal cost changes by multiplier times shift of a row."""
    problem = pq.Problem(horizon=6, dt=0.2, name="priced")
    x, u = problem.state("x", 2), problem.input("u", 1)
    shift = problem.parameter("shift", 4)
    problem.dynamics(x, x + problem.dt * ca.vertcat(x[1], u) + ca.vertcat(0, shift[0]))
    problem.residual("effort", u)
    problem.inequality("push", u - 1.4 + shift[1], policy=pq.Hard())
    problem.equality("arrival", x - ca.vertcat(0.5, 0.0) + shift[2:], at="terminal")
    lowered = problem.lower()
    solver = pq.Sqp(lowered)

    def cost(knot, entry, value):
        parameters = lowered.parameters()
        parameters["shift"][knot, entry] = value
        return solver.solve(parameters, lowered.knot())

    plan = cost(0, 0, 0.0)
    h = 1e-4
    for name, column, knot, entry in [
        ("dynamics of x", 1, 2, 0), ("push", 0, 0, 1), ("arrival", 0, 6, 2), ("arrival", 1, 6, 3),
    ]:  # fmt: skip
        slope = (cost(knot, entry, h).cost - cost(knot, entry, -h).cost) / (2 * h)
        assert plan.multipliers[name][knot, column] == pytest.approx(slope, rel=1e-5, abs=1e-6)
    assert plan.multipliers["push"][0, 0] > 1


def test_rows_are_named_and_pickle():
    plan = pq.Sqp(cart()).solve(cart().parameters(), cart().knot())
    rows = plan.rows()
    push = [r for r in rows if r.constraint == "push" and r.knot == 2]
    assert [(r.robot, r.limb, r.row, r.kind) for r in push] == [
        ("left", "LF", 0, "inequality"), ("right", "", 0, "inequality"),
    ]  # fmt: skip
    u = plan.trajectory["u"][2, 0]
    assert [r.value for r in push] == pytest.approx([u - 1.3, -u - 1.3])
    assert push[0].name == "push (robot left, limb LF, row 0, knot 2)"
    kinds = {r.kind for r in rows}
    assert kinds == {"dynamics", "equality", "inequality", "link"}
    again = pickle.loads(pickle.dumps(plan))
    assert str(again.rows()) == str(rows)
    np.testing.assert_array_equal(again.multipliers["arrival"], plan.multipliers["arrival"])


def test_penalised_rows_have_their_slope():
    plan = pq.Sqp(cart(hard=False)).solve(cart().parameters(), cart().knot())
    for row in plan.rows():
        if row.constraint == "push":
            policy = _core.Policy(1, 50.0, 1e-3)
            slope = _core.evaluate_penalty(policy, row.value)[1]
            assert row.multiplier == pytest.approx(slope)


def test_a_real_time_step_has_multipliers_too():
    lowered = cart()
    plan = pq.Sqp(lowered, max_iterations=1).solve(lowered.parameters(), lowered.knot())
    assert np.isfinite(plan.multipliers["dynamics of x"][:-1]).all()  # linear: one step is enough
    reference = pq.Ipopt(lowered).solve(lowered.parameters(), lowered.knot())
    assert_same_multipliers(plan, reference)


# ---- certificates --------------------------------------------------------------------------------


def test_contradictions_have_a_certificate():
    lowered = cart("torn", again=lambda x, _: x[0] - 0.2)
    plan = pq.Sqp(lowered).solve(lowered.parameters(), lowered.knot())
    assert plan.status is pq.Status.INFEASIBLE
    assert_certified(plan, lowered)
    named = {r.constraint: r.multiplier for r in plan.certificate if r.kind == "equality"}
    assert named["again"] == pytest.approx(np.sqrt(0.5), abs=1e-3)
    text = plan.explain()
    assert "again (row 0, knot 6)" in text.partition("cancel each other")[2]
    assert np.isnan(plan.multipliers["push"]).all()


def test_out_of_reach_has_a_certificate():
    """Hard bounds on the input against an arrival that is too far."""
    problem = pq.Problem(horizon=5, dt=0.2, name="far")
    x, u = problem.state("x", 2), problem.input("u", 1)
    problem.dynamics(x, increment=problem.dt * ca.vertcat(x[1], ca.sin(x[0]) + u))
    problem.residual("effort", u)
    problem.inequality("push", ca.vertcat(u, -u) - 0.5, policy=pq.Hard())
    problem.equality("arrival", x[0] - 3, at="terminal")
    lowered = problem.lower()
    plan = pq.Sqp(lowered).solve(lowered.parameters(), lowered.knot())
    assert plan.status is pq.Status.INFEASIBLE
    assert_certified(plan, lowered)
    assert {"push", "arrival"} <= {r.constraint for r in plan.certificate}


def assert_certified(plan, lowered):
    """The weighted rows' derivatives cancel each other by differences along every variable, and the
    weighted residual is positive.
    """
    weights = {r.name: r.multiplier for r in plan.certificate}
    of_rows = [r.multiplier for r in plan.certificate if r.kind != "dynamics"]
    assert np.linalg.norm(of_rows) == pytest.approx(1, abs=1e-3)
    assert all(r.multiplier >= 0 for r in plan.certificate if r.kind == "inequality")
    assert sum(r.multiplier * r.value for r in plan.certificate) > 1e-3

    def weighted(xs):
        at = lowered.evaluate(xs, lowered.parameters(), lowered.knot())
        return sum(weights.get(row.name, 0.0) * row.value for row in at.rows())

    slopes, h = [], 1e-5
    for k, i in np.ndindex(plan.xs.shape):
        if k == 0 and i in (0, 1):  # x_0 is given
            continue
        ahead, behind = plan.xs.copy(), plan.xs.copy()
        ahead[k, i] += h
        behind[k, i] -= h
        slopes.append((weighted(ahead) - weighted(behind)) / (2 * h))
    assert np.abs(slopes).max() < 1e-3


def test_feasible_plans_have_none():
    plan = pq.Sqp(cart()).solve(cart().parameters(), cart().knot())
    assert plan.certificate == []
    assert plan.non_finite is None


# ---- what is not finite --------------------------------------------------------------------------

ROW = "bad (limb RH, row 0, knot 0)"
BAD = {
    "value": ("inequality", lambda x, _: -ca.sqrt(x - 1), "running", ROW),
    "slope": ("equality", lambda x, _: ca.sqrt(x), "running_linear", f"the derivative of {ROW}"),
    "link": ("link", lambda _, before: ca.log(before - 1), "link", ROW),
    "link slope": (
        "link", lambda _, before: ca.sqrt(before), "link_linear",
        "the derivative of bad (limb RH, row 0, knot 1)",
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", BAD)
def test_the_first_nan_is_data(kind):
    word, expression, function, what = BAD[kind]
    problem = pq.Problem(horizon=3, dt=0.1, name="nan")
    x, u = problem.state("x", 1), problem.input("u", 1)
    problem.dynamics(x, increment=problem.dt * u)
    problem.residual("effort", u - 1)
    getattr(problem, word)("bad", expression(x[0], problem.previous(x)[0]), limb="RH")
    lowered = problem.lower()
    plan = pq.Sqp(lowered).solve(lowered.parameters(), lowered.knot())
    assert plan.status is pq.Status.NON_FINITE
    knot = int(what.rpartition("knot ")[2].rstrip(")"))
    assert (plan.non_finite.function, plan.non_finite.what, plan.non_finite.knot) == (
        function, what, knot,
    )  # fmt: skip
    assert plan.report().non_finite == plan.non_finite
    assert f"function '{function}' is not finite in {what}" in plan.explain()


def test_a_guess_that_is_not_finite_is_data():
    lowered = cart()
    guess = lowered.trajectory()
    guess["u"][3] = np.inf
    plan = pq.Sqp(lowered).solve(lowered.parameters(), lowered.knot(), guess)
    assert (plan.non_finite.function, plan.non_finite.what, plan.non_finite.knot) == (
        "guess", "block 'u' (knot 3)", 3,
    )  # fmt: skip
