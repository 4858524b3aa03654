"""A lowered problem stays what was stated, and travels as one folder or a pickle."""

import copy
import os
import pickle
import subprocess
import sys
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from support.small_problems import LIBRARY

import palanquin as pq
from palanquin import _core, compilation


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    folder = tmp_path / "cache"
    monkeypatch.setenv("PALANQUIN_CACHE", str(folder))
    return folder


def lander(policy=None, mass=2.0, horizon=12):
    """A body that sinks onto a floor: quaternions, a chart, roles, and every kind of row."""
    problem = pq.Problem(horizon=horizon, dt=0.1, name="lander")
    q, w = problem.quaternion_state("q"), problem.state("w", 3)
    z, v = problem.state("z", 1), problem.state("v", 1)
    thrust, torque = problem.input("thrust", 1), problem.input("torque", 3)
    m = problem.parameter("mass", default=mass)
    slope = problem.parameter("slope", (1, 2), [[0.1, 0.2]])
    foot = problem.variable(
        "foot", 3, role=pq.Role.LOCAL, chart=pq.Chart(2, lambda y: ca.vertcat(y, slope @ y))
    )
    problem.dynamics(q, increment=lambda: problem.dt * problem.next(w))
    problem.dynamics(w, increment=problem.dt * torque)
    problem.dynamics(v, increment=problem.dt * (thrust / m - 9.81))
    problem.dynamics(z, z + problem.dt * problem.next(v))
    problem.residual("attitude", q[1:4], weight=[1, 2, 3], at="all")
    problem.residual("effort", ca.vertcat(thrust - m * 9.81, torque, w), weight=0.1)
    problem.residual("height", ca.sin(z - 0.2), weight=5.0, at="all")
    problem.residual("foot", foot - ca.vertcat(0.1, 0.2, 0.3))
    problem.cost("comfort", ca.cosh(v))
    problem.inequality("floor", 0.4 - z, policy=policy or pq.Hard(), at="all")
    problem.inequality("engine", thrust <= 30, policy=pq.RelaxedBarrier(0.1, 0.05))
    return problem


def solve(lowered, qp="multipliers", **options):
    """The plan from a start at some height."""
    measured = lowered.knot()
    measured["z"], measured["v"], measured["q"] = 1.0, -0.5, [0.8, 0.6, 0, 0]
    return pq.Sqp(lowered, qp=qp, **options).solve(lowered.parameters(), measured)


def run_python(program, *arguments, **environment):
    """What a program prints that can import this module."""
    command = [sys.executable, "-c", program, *map(str, arguments)]
    here = Path(__file__).parent
    env = os.environ | {"PYTHONPATH": f"{here}:{here.parent}"}
    env |= {k: str(v) for k, v in environment.items()}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=env)
    assert done.returncode == 0, done.stderr
    return done.stdout


# ---- a lowered problem stays as it was lowered ---------------------------------------------------


def optimum(lowered, **options):
    measured = lowered.knot()
    if "z" in measured:
        measured["z"] = 1.0
    plan = pq.Ipopt(lowered, **options).solve(lowered.parameters(), measured)
    assert plan.status is pq.Status.CONVERGED
    return plan.xs


def integrator():
    problem = pq.Problem(horizon=3, dt=0.1, name="integrator")
    x, u = problem.state("x", 1), problem.input("u", 1)
    problem.dynamics(x, increment=problem.dt * u)
    problem.residual("goal", x - 1, at="all")
    problem.residual("effort", u, weight=0.1)
    return problem, x, u


def test_what_is_added_later_does_not_reach_the_further_libraries():
    problem, x, u = integrator()
    untouched = optimum(problem.lower())
    compilation.cache_folder().rename(compilation.cache_folder().with_name("other"))
    problem, x, u = integrator()
    lowered = problem.lower()
    problem.residual("late", u - 40, weight=100.0)
    problem.inequality("late_row", x - 0.01, policy=pq.Hard())
    y = problem.state("y", 2)
    problem.dynamics(y, y)
    problem.horizon, problem.name = 7, "changed"
    np.testing.assert_array_equal(optimum(lowered), untouched)
    exact = pq.Sqp(lowered, hessian="exact").solve(lowered.parameters(), lowered.knot())
    np.testing.assert_allclose(exact.xs, untouched, atol=1e-6)
    assert (lowered.name, lowered.horizon, lowered.policies) == ("integrator", 3, {})


def test_what_is_added_later_leads_to_a_new_lowering():
    problem, _, u = integrator()
    first = problem.lower()
    first.library("nlp")
    problem.residual("late", u - 40, weight=100.0)
    second = problem.lower()
    assert second.report.path != first.report.path
    assert second.library("nlp") != first.library("nlp")
    assert optimum(second)[0, 1] > 30 > optimum(first)[0, 1]


def test_the_kind_of_a_cost_is_part_of_what_is_lowered():
    """Residuals have Gauss-Newton Hessians, costs exact ones, whatever their values."""

    def stated(as_residual):
        problem, x, _ = integrator()
        if as_residual:
            problem.residual("wave", ca.sin(x))
        else:
            problem.cost("wave", ca.sin(x) ** 2)
        return problem.lower().report.path

    assert stated(True) != stated(False)


def test_libraries_of_another_problem_are_refused():
    lowered, other = lander().lower(), lander().lower()
    spinner = LIBRARY["Spinner"].build().lower()
    twin = lander()
    twin.residual("more", twin.blocks[2].symbol)  # the same sizes
    exact = pq.configure(_core.SqpSettings(), hessian="exact")
    for strange in (spinner, twin.lower()):
        with pytest.raises(RuntimeError, match="was lowered from another problem"):
            _core.LoweredProblem(str(strange.report.path), lowered._code.manifest)
        with pytest.raises(RuntimeError, match="was lowered from another problem"):
            _core.Ipopt(lowered.core, strange.library("nlp"), 3, _core.IpoptSettings())
        with pytest.raises(RuntimeError, match="was lowered from another problem"):
            _core.Sqp(lowered.core, 3, exact, strange.library("exact"))
    _core.Ipopt(lowered.core, other.library("nlp"), 3, _core.IpoptSettings())


def test_a_damaged_further_library_is_rebuilt():
    lowered = lander().lower()
    path = Path(lowered.library("exact"))
    size = path.stat().st_size
    path.unlink()
    path.write_bytes(bytes(size))
    assert solve(lowered, hessian="exact").is_usable


# ---- the engine knows what was stated ------------------------------------------------------------

POLICIES = [pq.Hard(), pq.Penalty(77.0, 0.02), pq.SquaredHinge(9.0), pq.RelaxedBarrier(0.3, 0.04)]


@pytest.mark.parametrize("policy", POLICIES, ids=lambda p: type(p).__name__)
def test_the_cache_serves_the_statement_of_the_last_lowering(policy):
    path = lander(pq.Penalty(1.0)).lower().report.path
    lowered = lander(policy, mass=3.5, horizon=9).lower()
    assert lowered.report.path == path
    core = _core.LoweredProblem(str(path))  # as a C++ program would
    assert (core.horizon, lowered.horizon) == (9, 9)
    assert {p.name: p.defaults for p in core.parameters} == {
        "dt": [0.1], "mass": [3.5], "slope": [0.1, 0.2]
    }  # fmt: skip
    stated = core.policies["floor"]
    assert (int(stated.kind), stated.stiffness, stated.smoothing) == (
        policy.kind, *policy.coefficients()
    )  # fmt: skip
    assert lowered.policies["floor"] == policy


# ---- one folder ----------------------------------------------------------------------------------


def same_plan(one, other):
    assert one.status == other.status
    np.testing.assert_array_equal(one.xs, other.xs)


@pytest.mark.parametrize("policy", POLICIES, ids=lambda p: type(p).__name__)
def test_a_saved_problem_gives_the_same_plan(policy, tmp_path, monkeypatch):
    lowered = lander(policy, mass=3.0).lower()
    plan = solve(lowered)
    lowered.save(tmp_path / "folder")
    monkeypatch.setenv("PALANQUIN_CACHE", str(tmp_path / "empty"))
    loaded = pq.load(tmp_path / "folder")
    assert (loaded.name, loaded.horizon, loaded.policies) == ("lander", 12, lowered.policies)
    assert loaded.parameters()["slope"].shape == (13, 1, 2)
    assert loaded.parameters()["mass"].tolist() == [3.0] * 13
    same_plan(solve(loaded), plan)
    assert not (tmp_path / "empty").exists()


def test_exact_hessians_and_ipopt_work_from_a_saved_problem(tmp_path, monkeypatch):
    lowered = lander().lower()
    lowered.save(tmp_path / "folder")
    exact, ground_truth = solve(lowered, hessian="exact"), optimum(lowered, penalize=True)
    monkeypatch.setenv("PALANQUIN_CACHE", str(tmp_path / "empty"))
    loaded = pq.load(str(tmp_path / "folder"))
    same_plan(solve(loaded, hessian="exact"), exact)
    np.testing.assert_array_equal(optimum(loaded, penalize=True), ground_truth)


PLAN_OF_A_FOLDER = """
import sys
import numpy as np, palanquin as pq
from test_saved_problem import solve
np.save(sys.argv[2], solve(pq.load(sys.argv[1])).xs)
"""


def test_a_saved_problem_needs_no_compiler_and_no_cache(tmp_path):
    lowered = lander().lower()
    lowered.save(tmp_path / "folder")
    run_python(
        PLAN_OF_A_FOLDER, tmp_path / "folder", tmp_path / "plan.npy",
        PATH="/nowhere", PALANQUIN_CACHE=tmp_path / "empty",
    )  # fmt: skip
    np.testing.assert_array_equal(np.load(tmp_path / "plan.npy"), solve(lowered).xs)
    assert not (tmp_path / "empty").exists()


@pytest.mark.parametrize("spoil", [Path.unlink, lambda p: os.truncate(p, 100)])
def test_code_is_compiled_where_the_library_does_not_serve(spoil, tmp_path):
    lowered = lander().lower()
    plan = solve(lowered)
    spoil(lowered.save(tmp_path / "folder") / "sqp.so")
    loaded = pq.load(tmp_path / "folder")
    assert not loaded.report.cache_hit
    same_plan(solve(loaded), plan)
    assert pq.load(tmp_path / "folder").report.cache_hit


def test_saving_again_replaces_what_was_saved(tmp_path):
    lander(pq.Penalty(1.0)).lower().save(tmp_path / "folder")
    lander(pq.Hard(), horizon=5).lower().save(tmp_path / "folder")
    loaded = pq.load(tmp_path / "folder")
    assert (loaded.horizon, loaded.policies["floor"]) == (5, pq.Hard())
    again = loaded.save(tmp_path / "again")
    names = sorted(p.name for p in again.iterdir())
    assert names == [
        "CMakeLists.txt", "README.md", "exact.c", "manifest", "nlp.c", "sqp.c", "sqp.so"
    ]  # fmt: skip
    for name in names:
        assert (again / name).read_bytes() == (tmp_path / "folder" / name).read_bytes()


def test_folders_that_hold_other_things_are_left_alone(tmp_path):
    lowered = lander().lower()
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "README.md").write_text("mine")
    (tmp_path / "file").write_text("mine")
    with pytest.raises(pq.LoweringError, match="thesis': it holds files of something else"):
        lowered.save(tmp_path / "thesis")
    with pytest.raises(pq.LoweringError, match="file': it is a file"):
        lowered.save(tmp_path / "file")
    with pytest.raises(pq.LoweringError, match="cannot save 'lander'"):
        lowered.save(tmp_path / "file" / "below")
    assert (tmp_path / "thesis" / "README.md").read_text() == "mine"


DAMAGES = {
    "nothing there": (lambda f: f.rename(f.with_name("gone")), "holds no saved problem"),
    "no manifest": (lambda f: (f / "manifest").unlink(), "holds no saved problem"),
    "no code": (lambda f: (f / "nlp.c").unlink(), r"holds no saved problem.*nlp\.c"),
    "empty manifest": (lambda f: (f / "manifest").write_text(""), "holds no whole manifest"),
    "no text": (lambda f: (f / "manifest").write_bytes(b"\xff\x00"), "holds no saved problem"),
    "another version": (
        lambda f: edit(f, "palanquin 2", "palanquin 99"), "lower the problem again"
    ),
    "another size": (
        lambda f: edit(f, "block thrust real 1", "block thrust real 2"), "from another problem"
    ),
    "another content": (lambda f: edit(f, "content ", "content 0"), "from another problem"),
    "no number": (lambda f: edit(f, "horizon 12", "horizon many"), "'many' must be an integer"),
    "a policy that is missing": (
        lambda f: edit(f, "policy floor hard 0.0 0.0\n", ""), "no policy of 'floor'"
    ),
}  # fmt: skip


def edit(folder, text, other):
    manifest = (folder / "manifest").read_text()
    assert text in manifest
    (folder / "manifest").write_text(manifest.replace(text, other))


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_folders_are_refused_in_words(damage, tmp_path):
    spoil, message = DAMAGES[damage]
    spoil(lander().lower().save(tmp_path / "folder"))
    with pytest.raises(pq.LoweringError, match=message):
        pq.load(tmp_path / "folder")


@pytest.mark.parametrize("part", [0.2, 0.5, 0.8])
def test_a_library_that_is_cut_off_is_not_loaded(part, tmp_path, monkeypatch, caplog):
    monkeypatch.setenv("PALANQUIN_CACHE", str(tmp_path / "cache"))
    lowered = lander().lower()
    library = lowered.save(tmp_path / "lander") / "sqp.so"
    whole = library.read_bytes()
    library.write_bytes(whole[: int(part * len(whole))])
    loaded = pq.load(tmp_path / "lander")
    assert "cut off; compiling its code" in caplog.text
    assert solve(loaded).cost == solve(lowered).cost


def test_exact_hessians_that_cannot_be_compiled_say_why(tmp_path, monkeypatch):
    monkeypatch.setenv("PALANQUIN_CACHE", str(tmp_path / "cache"))
    folder = lander().lower().save(tmp_path / "lander")
    (folder / "exact.c").write_text("int half(")
    with pytest.raises(pq.LoweringError, match="half"):
        pq.Sqp(pq.load(folder), hessian="exact")


def test_policies_and_defaults_may_be_edited_in_the_manifest(tmp_path):
    folder = lander().lower().save(tmp_path / "folder")
    edit(folder, "policy floor hard 0.0 0.0", "policy floor squared_hinge 50.0 0.0")
    edit(folder, "default mass 2.0", "default mass 4.0")
    same_plan(solve(pq.load(folder)), solve(lander(pq.SquaredHinge(50.0), mass=4.0).lower()))


# ---- pickles -------------------------------------------------------------------------------------

PLAN_OF_A_PICKLE = """
import pickle, sys
import numpy as np
from test_saved_problem import solve
with open(sys.argv[1], "rb") as file:
    lowered = pickle.load(file)
print(lowered.report.cache_hit)
np.save(sys.argv[2], [solve(lowered).xs, solve(lowered, hessian="exact").xs])
"""


@pytest.mark.parametrize("saved", [False, True])
@pytest.mark.parametrize("cache_of_the_other", ["cache", "another"])
def test_lowered_problems_pickle(saved, cache_of_the_other, tmp_path):
    lowered = lander(mass=3.0).lower()
    if saved:
        lowered = pq.load(lowered.save(tmp_path / "folder"))
    pickled, plans = tmp_path / "lowered.pickle", tmp_path / "plans.npy"
    pickled.write_bytes(pickle.dumps(lowered))
    printed = run_python(
        PLAN_OF_A_PICKLE, pickled, plans,
        PALANQUIN_CACHE=tmp_path / cache_of_the_other,
    )  # fmt: skip
    assert printed.strip() == str(saved or cache_of_the_other == "cache")
    gauss_newton, exact = np.load(plans)
    np.testing.assert_array_equal(gauss_newton, solve(lowered).xs)
    np.testing.assert_array_equal(exact, solve(lowered, hessian="exact").xs)


@pytest.mark.parametrize("name", ["Hopper", "RigidBody", "MoveBlocking", "ConvexCost"])
def test_problems_of_all_kinds_survive_pickling(name, cache):
    lowered = LIBRARY[name].build().lower()
    again = pickle.loads(pickle.dumps(lowered))
    assert again.report.path == lowered.report.path
    assert again.policies == lowered.policies
    assert again._code.source("nlp") == lowered._code.source("nlp")
    assert again._code.source("sqp") == lowered._code.source("sqp")


def test_settings_pickle_and_copy():
    settings = pq.configure(
        _core.SqpSettings(), qp="osqp", hessian="exact", form="paper", max_iterations=7,
        line_search={"armijo": 0.3}, qp_settings={"osqp": {"rho": 0.7}},
    )  # fmt: skip
    ipopt = pq.configure(_core.IpoptSettings(), penalize=True, tolerance=1e-3)
    for clone in (lambda s: pickle.loads(pickle.dumps(s)), copy.deepcopy, copy.copy):
        assert described(clone(settings)) == described(settings)
        assert described(clone(ipopt)) == described(ipopt)
    deep = copy.deepcopy(settings)
    deep.line_search.armijo = 0.1
    assert settings.line_search.armijo == 0.3


def described(settings):
    """All fields, nested ones too."""
    fields = [n for n in dir(settings) if not n.startswith("_") and n != "explain_invalid"]
    return {
        n: described(v) if type(v).__name__.endswith("Settings") else v
        for n, v in ((n, getattr(settings, n)) for n in fields)
    }


@pytest.mark.parametrize("policy", POLICIES, ids=lambda p: type(p).__name__)
def test_policies_pickle(policy):
    assert pickle.loads(pickle.dumps(policy)) == policy


# ---- arrays --------------------------------------------------------------------------------------


def test_arrays_are_taken_wherever_named_ones_are():
    lowered = lander().lower()
    plan = solve(lowered)
    parameters = lowered.parameters()
    assert np.asarray(plan.trajectory).shape == plan.xs.shape
    assert np.asarray(parameters) is parameters.values
    assert np.array(parameters) is not parameters.values
    assert np.asarray(parameters, dtype=np.float32).dtype == np.float32
    measured = lowered.knot()
    measured["z"], measured["v"], measured["q"] = 1.0, -0.5, [0.8, 0.6, 0, 0]
    for guess in (plan.xs, plan.trajectory, plan.xs.tolist()):
        again = pq.Sqp(lowered, qp="multipliers").solve(parameters, measured, guess=guess)
        assert again.iteration_count < plan.iteration_count
        assert again.status is pq.Status.CONVERGED
    again = pq.Ipopt(lowered).solve(parameters, np.asarray(measured), guess=plan.xs)
    assert again.status is pq.Status.CONVERGED


@pytest.mark.parametrize("as_given", [np.asarray, lambda p: p.values.tolist()])
def test_parameters_may_be_bare(as_given):
    lowered = lander().lower()
    named = lowered.parameters()
    bare, measured = as_given(named), np.asarray(lowered.knot())
    expected = pq.Sqp(lowered).solve(named, measured)
    assert pq.Sqp(lowered).solve(bare, measured).cost == expected.cost
    solver = pq.Sqp(lowered, max_iterations=1)
    assert solver.prepare(bare, measured)
    assert solver.feedback(measured).status is pq.Status.ITERATION_LIMIT
    choice = pq.Candidates(lowered, 2).solve(np.asarray(bare), measured, [expected.xs] * 2)
    assert choice.plan.status is pq.Status.CONVERGED
    wrong = np.asarray(bare)
    wrong[1, 0] = 0.0
    with pytest.raises(pq.ProblemError, match=r"parameter 'dt' is 0.0 at knot 1"):
        pq.Sqp(lowered).solve(wrong, measured)
    with pytest.raises(ValueError, match=r"parameters have shape \[.*\] is needed"):
        pq.Sqp(lowered).solve(wrong[:, 1:], measured)
