"""The suite of optimal control problems: how answers are judged, run, kept and shown."""

import json

import numpy as np
import pytest
from support.kkt import WholeHorizon
from support.manifold import jacobian
from support.small_problems import LIBRARY
from typer.testing import CliRunner

import palanquin as pq
from palanquin.benchmarks.suites import rates
from palanquin.benchmarks.suites.certificate import KktError, kkt_error, violation_slope
from palanquin.benchmarks.suites.report import performance_profile
from palanquin.benchmarks.suites.stated_program import StatedProgram
from palanquin.benchmarks.suites.verdict import Verdict, judge
from palanquin.cli import app

CERTIFIED, LOOSE = KktError(1e-9, 1e-9, 0.0), KktError(1e-2, 1e-9, 0.0)


@pytest.mark.parametrize(
    ("status", "error", "cost", "verdict"),
    [
        ("converged", CERTIFIED, 1.0, Verdict.OPTIMAL),
        ("converged", CERTIFIED, 0.5, Verdict.OPTIMAL),
        ("converged", CERTIFIED, 1.1, Verdict.DEARER),
        ("converged", LOOSE, 1.0, Verdict.WRONG_CONVERGED),
        ("converged", KktError(0.0, 1e-3, 0.0), 1.0, Verdict.WRONG_CONVERGED),
        ("converged", KktError(0.0, 0.0, 1e-3), 1.0, Verdict.WRONG_CONVERGED),
        ("converged", None, 1.0, Verdict.WRONG_CONVERGED),
        ("iteration_limit", CERTIFIED, 1.0, Verdict.NOT_SAID),
        ("iteration_limit", LOOSE, 1.0, Verdict.FAILED),
        ("infeasible", LOOSE, 1.0, Verdict.WRONG_INFEASIBLE),
        ("infeasible", None, 0.0, Verdict.WRONG_INFEASIBLE),
        ("non_finite", None, 0.0, Verdict.FAILED),
        ("not taken", None, 0.0, Verdict.NOT_TAKEN),
    ],
)
def test_verdicts(status, error, cost, verdict):
    assert judge(status, error, cost, reference=1.0) is verdict


def test_infeasible_is_right_only_where_the_violation_is_stationary(lowered):
    """x+ = x + u with |u| <= 1 reaches 2 from 0 in 2 steps, but never 3."""
    assert judge("infeasible", LOOSE, 1.0, 1.0, slope=1e-9) is Verdict.STUCK
    assert judge("infeasible", LOOSE, 1.0, 1.0, slope=1e-2) is Verdict.WRONG_INFEASIBLE
    problem = pq.Problem(horizon=2, dt=1.0)
    x, u = problem.state("x", 1), problem.input("u", 1)
    problem.dynamics(x, x + u)
    problem.residual("effort", u)
    problem.equality("arrival", x - 3, at="terminal")
    problem.inequality("limit", u - 1, pq.Hard())
    lowered = problem.lower()
    program = StatedProgram(problem, lowered.parameters(), lowered.knot())
    columns = [[0, 1], [1, 1], [2, 0]]
    assert violation_slope(program.expand(np.array(columns, float))) < 1e-9
    columns = [[0, 0.5], [0.5, 0.5], [1.0, 0]]
    assert violation_slope(program.expand(np.array(columns, float))) > 0.1


@pytest.mark.parametrize("name", ["HardBoundedIntegrator", "RigidBody", "Hopper", "Pendulum"])
def test_the_stated_program_has_the_derivatives_and_optima_of_others(name, lowered):
    """Roles by shared variables here, by rows there; a step off the optimum is no KKT point."""
    problem, inputs = LIBRARY[name].build(), LIBRARY[name].inputs(lowered(name))
    plan = pq.Ipopt(lowered(name), penalize=True).solve(*inputs)
    program = StatedProgram(problem, inputs.parameters, inputs.measured)
    at = program.expand(plan.xs)
    assert at.cost == pytest.approx(plan.cost)
    error = kkt_error(at)
    assert max(error.stationarity, error.equality, error.inequality) < 1e-6
    other = WholeHorizon(problem, inputs.parameters, inputs.measured, plan.trajectory)
    assert other.kkt_residual().max < 1e-6

    moved = plan.xs.copy()
    column = next(b for b in problem.blocks if not b.is_quaternion and b.is_state).name
    lowered(name).wrap(moved)[column][3] += 0.1
    off = kkt_error(program.expand(moved))
    assert max(off.equality, off.stationarity) > 1e-3


def test_derivatives_of_the_stated_program(lowered):
    inputs = LIBRARY["BoundedIntegrator"].inputs(lowered("BoundedIntegrator"))
    program = StatedProgram(
        LIBRARY["BoundedIntegrator"].build(), inputs.parameters, inputs.measured
    )
    z = np.random.default_rng(0).normal(size=inputs.guess.values.shape)
    at = program.expand(z)
    # In a vector space a step of the variables is one of the entries: inputs of all knots but the
    # last, states of all but the first, knot by knot.
    free = np.ones_like(z, dtype=bool)
    free[0, :2], free[-1, 2] = False, False

    def moved(step):
        other = z.copy()
        other[free] += step
        return program.expand(other)

    cost = jacobian(lambda d: np.array([moved(d).cost]), free.sum())
    np.testing.assert_allclose(at.gradient, cost[0], rtol=1e-6, atol=1e-6)
    rows = jacobian(lambda d: moved(d).equalities, free.sum())
    np.testing.assert_allclose(at.equality_jacobian, rows, atol=1e-8)


def test_profiles_count_what_was_solved():
    def row(solver, problem, iterations, verdict=Verdict.OPTIMAL):
        return {"solver": solver, "problem": problem, "start": "rest", "iterations": iterations,
                "verdict": str(verdict)}  # fmt: skip

    rows = [row("a", "p", 4), row("a", "q", 10), row("b", "p", 8), row("b", "q", 5, Verdict.FAILED)]
    profile = performance_profile(rows, "iterations")
    np.testing.assert_array_equal(profile["a"], [1, 1])
    np.testing.assert_array_equal(profile["b"], [2])


def run(*arguments):
    return CliRunner().invoke(app, ["bench", *map(str, arguments)])


def test_the_suite_runs_resumes_and_reports(tmp_path, session_cache, monkeypatch):
    monkeypatch.setenv("PALANQUIN_CACHE", str(session_cache))
    out, file = tmp_path / "out", tmp_path / "rows.json"
    solvers = "structured; multipliers; casadi fatrop"
    options = ["--problems", "unicycle,slacks", "--solvers", solvers, "--out", out, "--json", file]
    first = run("suites", *options)
    assert first.exit_code == 0, first.output
    results = json.loads(file.read_text())
    assert results == json.loads((out / "results.json").read_text())
    assert len(results["rows"]) == 2 * 3 * 3
    for row in results["rows"]:
        if row["verdict"] != Verdict.NOT_TAKEN:
            assert row["verdict"] == Verdict.OPTIMAL
            assert row["stationarity"] < 1e-4
            assert row["excess"] == pytest.approx(0, abs=1e-6)
    assert {p.name for p in out.glob("*.png")} == {
        "profile-iterations.png",
        "profile-milliseconds.png",
    }
    kept = (out / "suites.jsonl").read_text().splitlines()
    (out / "suites.jsonl").write_text("\n".join(kept[:5]) + "\n")
    assert run("suites", *options, "--resume").exit_code == 0
    again = json.loads(file.read_text())["rows"]
    assert again[:5] == results["rows"][:5]
    assert [r["verdict"] for r in again] == [r["verdict"] for r in results["rows"]]


@pytest.mark.parametrize("option", ["--problems", "--solvers"])
def test_unknown_names_are_listed(option):
    answer = run("suites", option, "nonsense")
    assert answer.exit_code == 2
    assert "'nonsense' is unknown; there are" in answer.stderr


def test_loops_compare_one_iteration_with_convergence(tmp_path, session_cache, monkeypatch):
    monkeypatch.setenv("PALANQUIN_CACHE", str(session_cache))
    file = tmp_path / "loops.json"
    answer = run("loops", "--problems", "unicycle", "--json", file)
    assert answer.exit_code == 0, answer.output
    rows = json.loads(file.read_text())["rows"]
    assert len(rows) == 6
    for row in rows:
        assert sum(row["statuses"].values()) == row["steps"]
        assert row["unusable"] == 0
        assert row["cost_ratio"] == pytest.approx(1, abs=0.01)
        assert row["violation"] < 1e-6
    assert all(row["dropped"] == 0 for row in rows)


def test_rates_are_compared_with_the_step_without_them(tmp_path, session_cache, monkeypatch):
    """Limits that are not met change no plan; the ratio of what has no rates is one."""
    monkeypatch.setenv("PALANQUIN_CACHE", str(session_cache))
    monkeypatch.setattr(rates, "SIZES", ((4, 2),))
    file = tmp_path / "rates.json"
    result = CliRunner().invoke(app, ["bench", "rates", "--repetitions", "2", "--json", str(file)])
    assert result.exit_code == 0, result.output
    rows = json.loads(file.read_text())["rows"]
    assert [row["variant"] for row in rows] == [v.name for v in rates.VARIANTS]
    for row in rows:
        assert row["median_ms"] > 0
        assert (row["ratio"] == 1) == row["variant"].startswith("no rates")
    inputs = []
    for variant in (v for v in rates.VARIANTS if v.enters != "cost"):
        lowered = rates.build(4, 2, variant).lower()
        inputs.append(pq.Sqp(lowered).solve(lowered.parameters(), lowered.knot(),
                                            lowered.trajectory()).trajectory["u"])  # fmt: skip
        assert np.abs(np.diff(inputs[-1], axis=0)).max() < rates.LIMIT
        np.testing.assert_allclose(inputs[-1], inputs[0], atol=1e-6)
