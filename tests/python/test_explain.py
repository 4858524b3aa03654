"""A plan explains its worst rows, what the solver did, and whether it may be executed."""

import math
import pickle
import re

import casadi as ca
import pytest
from typer.testing import CliRunner

import palanquin as pq
from palanquin.cli import app


@pytest.fixture(autouse=True)
def cache(session_cache, monkeypatch):
    monkeypatch.setenv("PALANQUIN_CACHE", str(session_cache))


def cart(name="cart", **rows):
    """A cart whose push is bounded softly at a limb of a robot, in units of 100 N."""
    problem = pq.Problem(horizon=4, dt=0.1, name=name)
    x, u = problem.state("x", 2), problem.input("u", 1)
    problem.dynamics(x, increment=problem.dt * ca.vertcat(x[1], u))
    problem.residual("goal", x - ca.vertcat(3, 0), at="all")
    problem.residual("effort", u, weight=1e-3)
    problem.inequality(
        "push", ca.vertcat(-u - 9, u - 0.5), policy=pq.Penalty(5.0, 1e-4),
        robot="left", limb="LF", scale=100.0,
    )  # fmt: skip
    for row, expression in rows.items():
        problem.equality(row, expression(x, u), at="terminal")
    return problem.lower()


def solved(lowered, **options):
    return pq.Sqp(lowered, **options).solve(lowered.parameters(), lowered.knot())


def test_the_worst_row_is_named_with_owner_unit_and_multiplier():
    plan = solved(cart())
    report = plan.report(3)
    assert len(report.rows) == 3
    row = report.rows[0]
    assert (row.constraint, row.robot, row.limb, row.row) == ("push", "left", "LF", 1)
    push = plan.trajectory["u"][row.knot, 0] - 0.5
    assert row.value == pytest.approx(push)
    assert row.value * row.scale == pytest.approx(plan.violation["push"])
    assert row.multiplier == pytest.approx(2 * 5.0 * push)  # slope of K h^2
    assert [r.value for r in report.rows] == sorted((r.value for r in report.rows), reverse=True)
    assert [(str(r).partition(":")[0], r.value) for r in report.rows] == plan.worst_rows(3)
    text = plan.explain(3)
    assert f"push (robot left, limb LF, row 1, knot {row.knot}): {push:.3g} x 100" in text
    assert "multiplier" in text
    assert "may be executed: " in text


def test_rows_that_contradict_each_other_are_named():
    plan = solved(cart("torn", one=lambda x, _: x[0] - 1, two=lambda x, _: x[0] - 2))
    report = plan.report()
    assert not report.is_usable
    assert "may not be executed: a solve that ends as" in plan.explain()
    hard = [r for r in report.rows if r.constraint in ("one", "two")]
    assert hard
    assert all(r.knot == 4 and math.isnan(r.multiplier) and not r.robot for r in hard)


@pytest.mark.parametrize("solver", [pq.Sqp, pq.Ipopt])
def test_rows_that_are_met_are_not_among_the_worst(solver):
    """Dynamics are met to rounding, and rounding is no violation."""
    problem = pq.Problem(horizon=9, dt=0.1, name="torn")
    x, u = problem.state("x", 3), problem.input("u", 1)
    problem.dynamics(x, 0.7 * x + ca.vertcat(0.1 * u, ca.sin(x[0]), 0.3))
    problem.residual("effort", u)
    problem.equality("one", x[0] - 1, at="terminal")
    problem.equality("two", x[0] - 2, at="terminal")
    torn = problem.lower()
    plan = solver(torn).solve(torn.parameters(), torn.knot())
    assert plan.status is pq.Status.INFEASIBLE
    assert all(value > 1e-12 for _, value in plan.worst_rows(99))
    worst = re.findall(r"(\w+) \([^)]*\) ([-+.e\d]+)(?:, |$)", plan.message)
    assert {name for name, _ in worst} >= {"one", "two"}
    assert all(float(value) > 1e-9 for _, value in worst)


def test_the_dynamics_are_rows_too():
    plan = solved(cart(), max_iterations=1, subproblem={"max_inner_iterations": 1})
    names = {row.constraint for row in plan.report(50).rows}
    assert names <= {"push", "dynamics of x"}
    assert "push" in names


def test_residuals_beyond_the_limit_are_the_reason():
    """Residuals above the limit make a plan unusable, and the report says so."""
    problem = pq.Problem(horizon=4, dt=0.5, name="swing")
    x, u = problem.state("x", 2), problem.input("u", 1)
    problem.dynamics(x, increment=problem.dt * ca.vertcat(x[1], u + 9 * ca.sin(x[0])))
    problem.residual("goal", x - ca.vertcat(3, 0), at="all")
    problem.residual("effort", u, weight=1e-3)
    plan = solved(problem.lower(), max_iterations=1, usable_violation=1e-9)
    assert plan.status is pq.Status.UNFINISHED
    assert "may not be executed" in plan.explain()
    assert plan.report().rows[0].constraint == "dynamics of x"


def test_the_first_nan_is_named_with_function_and_knot():
    problem = pq.Problem(horizon=4, dt=0.1, name="nan")
    x, u = problem.state("x", 1), problem.input("u", 1)
    problem.dynamics(x, increment=problem.dt * u)
    problem.residual("effort", u)
    problem.inequality("root", -ca.sqrt(x[0] - 1), limb="RH")
    lowered = problem.lower()
    plan = solved(lowered)
    assert plan.status is pq.Status.NON_FINITE
    report = plan.report()
    assert not report.is_usable
    assert "knot 0" in report.message
    assert "root" in report.message
    assert report.message in str(report)


def test_steps_and_times_are_counted():
    plan = solved(cart())
    report = plan.report()
    assert sum(report.steps.values()) == plan.iteration_count
    assert report.steps["full"] >= 1
    assert f"steps of {plan.iteration_count} iterations: " in str(report)
    assert f"linearize {plan.timings_ms['linearize']:.3g}" in str(report)


def test_ipopts_plans_are_explained_and_pickled_ones_say_why_not():
    lowered = cart()
    plan = pq.Ipopt(lowered, penalize=True).solve(lowered.parameters(), lowered.knot())
    assert plan.report().rows[0].constraint == "push"
    assert "steps of" not in plan.explain()
    with pytest.raises(pq.ProblemError, match="results alone"):
        pickle.loads(pickle.dumps(plan)).explain()


def test_the_command_explains_failures_and_on_request(tmp_path):
    lowered = cart()
    good = solved(lowered).dump(tmp_path / "good.palanquin")
    torn = cart("torn", one=lambda x, _: x[0] - 1, two=lambda x, _: x[0] - 2)
    bad = solved(torn).dump(tmp_path / "bad.palanquin")

    def output(*arguments):
        return CliRunner().invoke(app, ["solve", *map(str, arguments)]).output

    assert "worst rows" not in output(good)
    assert "push (robot left, limb LF, row 1" in output(good, "--explain")
    assert "may not be executed" in output(bad)
