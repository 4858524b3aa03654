"""`check` finds wrong derivatives, kinks, NaN, dependent rows, negative curvature, idle inputs."""

import casadi as ca
import numpy as np
import pytest
from support.small_problems import LIBRARY

import palanquin as pq
from palanquin.checking.differences import Derivative, differences, faults
from palanquin.checking.structure import dependencies
from palanquin.lowering import exact, functions, knot, nlp

SQP = ("sqp",)


@pytest.fixture(autouse=True)
def cache(session_cache, monkeypatch):
    monkeypatch.setenv("PALANQUIN_CACHE", str(session_cache))


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    """For code that must not be found by others."""
    monkeypatch.setenv("PALANQUIN_CACHE", str(tmp_path / "cache"))


def glider():
    """A point with a turn, whose costs and rows a test adds to: all is smooth and independent."""
    problem = pq.Problem(horizon=5, dt=0.1, name="glider")
    x, q = problem.state("x", 2), problem.quaternion_state("q")
    u, w = problem.input("u", 2), problem.input("w", 3)
    problem.dynamics(x, increment=problem.dt * u)
    problem.dynamics(q, increment=problem.dt * w)
    problem.residual("goal", ca.vertcat(x - 1, q[1:4]), at="all")
    problem.residual("effort", ca.vertcat(u, w), weight=0.1)
    return problem, x, q, u, w


def found(report, kind):
    """Function, row and column of the findings of a kind."""
    return [(f.function, f.row, f.column) for f in report.findings if f.kind == kind]


# ---- what is right -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["Hopper", "RigidBody", "MoveBlocking"])
def test_nothing_is_found_in_sound_problems(name):
    report = LIBRARY[name].build().check()
    assert report.is_ok
    assert not report.findings
    assert {"running", "terminal", "exact_running", "exact_terminal", "nlp_running_hessian"} <= set(
        report.functions
    )
    assert ("chart" in report.functions) == (name == "Hopper")
    assert "errors: none" in str(report)


# ---- derivatives that are wrong ------------------------------------------------------------------

TAMPERED = {
    "state_jacobians": ("dynamics of x[0]", "x[0]"),
    "row_jacobians": ("slow (robot left, limb LF, row 0)", "u[0]"),
    "cost_derivatives": ("cost", "x[0]"),
}


@pytest.mark.parametrize("name", TAMPERED)
@pytest.mark.usefixtures("own_cache")
def test_a_wrong_derivative_is_found(monkeypatch, name):
    """Each part of the lowering with its first nonzero entry doubled."""
    true = getattr(functions, name)

    def doubled(*arguments):
        first, second = true(*arguments)
        changed = second if name == "row_jacobians" else first  # inequality rows come second
        if changed.nnz():
            row, column = (int(i[0]) for i in changed.sparsity().get_triplet())
            changed[row, column] = 2 * changed[row, column]
        return [first, second]

    problem, _, _, u, _ = glider()
    problem.inequality("slow", u[0] - 1, robot="left", limb="LF")
    monkeypatch.setattr(functions, name, doubled)
    report = problem.check(libraries=SQP)
    assert not report.is_ok
    assert ("running", *TAMPERED[name]) in found(report, "derivative")


# Function and index of a result of which one entry is changed; then what the finding is about.
PLANTED = {
    "chart": ("chart", 1, "chart of foot[2]"),
    "link": ("link_linear", 2, "rate (robot left, row 0)"),
    "link, knot before": ("link_linear", 1, "rate (robot left, row 0)"),
    "terminal rows": ("terminal_linear", 6, "end (row 0)"),
    "exact Hessian": ("exact_running", 0, "Lagrangian's gradient by "),
    "exact terminal Hessian": ("exact_terminal", 0, "Lagrangian's gradient by "),
    "Ipopt's dynamics": ("nlp_running", 4, "dynamics of "),
    "Ipopt's cost": ("nlp_terminal", 3, "cost"),
    "Ipopt's link": ("nlp_link", 2, "rate (robot left, row 0)"),
    "Ipopt's Hessian": ("nlp_running_hessian", 0, "Lagrangian's gradient by "),
    "Ipopt's link Hessian": ("nlp_link_hessian", 0, "Lagrangian's gradient by "),
}


@pytest.mark.parametrize("fault", PLANTED)
@pytest.mark.usefixtures("own_cache")
def test_a_fault_of_any_function_is_found_and_named(monkeypatch, fault):
    """One entry is changed in what is compiled; every other function stays as it is."""
    name, index, row = PLANTED[fault]
    true = knot.function

    def changed(problem, of, arguments, results):
        if of == name:
            wrong = ca.SX(results[index])
            i, j = (int(entry[-1]) for entry in wrong.sparsity().get_triplet())
            wrong[i, j] += 0.5
            results = [*results[:index], wrong, *results[index + 1 :]]
        return true(problem, of, arguments, results)

    for module in (functions, exact, nlp):
        monkeypatch.setattr(module, "function", changed)
    problem, x, _, u, _ = glider()
    ground = pq.Chart(2, lambda y: ca.vertcat(y, 0.1 * y[0] ** 2))
    foot = problem.variable("foot", 3, role=pq.Role.LOCAL, chart=ground)
    problem.residual("foot", foot - 1)
    problem.link("rate", u[0] - problem.previous(u)[0] ** 2, robot="left")
    problem.inequality("end", x[0] - 1, at="terminal")
    report = problem.check()
    assert not report.is_ok
    wrong = [(of, which) for of, which, _ in found(report, "derivative")]
    assert any(of == name.removesuffix("_linear") and which.startswith(row) for of, which in wrong)
    others = {of for of, _ in wrong} - {name.removesuffix("_linear")}
    assert not others - {f"{name}_hessian"}  # differences of a wrong Jacobian


@pytest.mark.usefixtures("own_cache")
def test_a_wrong_hessian_is_found(monkeypatch):
    true = functions.cost_derivatives

    def without_an_entry(problem, knot, at):
        gradient, hessian = true(problem, knot, at)
        hessian[4, 2] += 0.5
        return gradient, hessian

    monkeypatch.setattr(functions, "cost_derivatives", without_an_entry)
    report = glider()[0].check(libraries=SQP)
    expected = ("running", "cost's Hessian in q.rotation[2]", "q.rotation[0]")
    assert expected in found(report, "derivative")


@pytest.mark.parametrize(
    ("expression", "kind"),
    [
        (lambda x: ca.if_else(x > 0, x, 3 * x), "kink"),
        (lambda x: ca.fabs(x), "kink"),
        (lambda x: ca.if_else(x >= 0, 1 + x, x), "kink"),
        (lambda x: ca.sign(x), "kink"),
        (lambda x: ca.sqrt(x), "non-finite"),
        (lambda x: ca.norm_2(ca.vertcat(x, x)), "non-finite"),
        (lambda x: ca.log(x), "undefined"),
    ],
    ids=["bend", "fabs", "step", "sign", "sqrt", "norm", "log"],
)
def test_what_casadi_derives_wrongly_is_named(expression, kind):
    """At the neutral knot, where x is zero, and by the term's name instead of the whole cost's."""
    problem, x, _, u, _ = glider()
    y = problem.state("y", 1)
    problem.dynamics(y, y + expression(x[1]) + u[0])
    problem.residual("residual", expression(x[1]))
    problem.cost("cost", expression(x[1]))
    problem.inequality("row", expression(x[1]), limb="RF")
    report = problem.check(libraries=SQP, random_points=0)
    findings = {(f.row, f.column, f.where) for f in report.findings if f.kind == kind}
    column = "" if kind == "undefined" else "x[1]"
    names = ("residual 'residual'", "cost 'cost'", "row (limb RF, row 0)", "dynamics of y[0]")
    assert findings >= {(name, column, "neutral") for name in names}
    assert not any(f.row == "cost" for f in report.findings)
    assert report.is_ok == (kind != "non-finite")


def test_a_kink_is_found_at_a_given_knot_alone():
    problem, x, _, _, _ = glider()
    problem.residual("odd", ca.fabs(x[0] - 3))
    lowered = problem.lower()
    trajectory = lowered.trajectory()
    trajectory["x"][-1] = [3, 0]
    assert not lowered.check(libraries=SQP).findings
    report = lowered.check(trajectory=trajectory, libraries=SQP)
    assert [f.where for f in report.findings] == ["knot 5", "knot 5"][: len(report.findings)]
    assert found(report, "kink") == [("running", "residual 'odd'", "x[0]")]


def test_saved_problems_are_checked_by_their_code(tmp_path):
    problem, x, _, _, _ = glider()
    problem.residual("odd", ca.fabs(x[1]))
    problem.inequality("root", ca.sqrt(x[0]) - 1, limb="LF")
    report = pq.load(problem.lower().save(tmp_path / "saved")).check(libraries=SQP)
    assert ("running", "root (limb LF, row 0)", "x[0]") in found(report, "non-finite")


# ---- structure -----------------------------------------------------------------------------------


def test_dependent_rows_are_named_with_those_that_they_repeat():
    problem, x, _, u, _ = glider()
    problem.equality("first", u[0] - u[1], robot="left")
    problem.equality("other", u[1] + x[0])
    problem.equality("again", 2 * u[0] - 2 * u[1] - 1, robot="right", limb="RF")
    problem.equality("empty", problem.parameter("c", 1))
    report = problem.check(libraries=SQP)
    assert not report.is_ok
    messages = {f.row: f.message for f in report.findings if f.kind == "rank"}
    assert set(messages) == {"again (robot right, limb RF, row 0)", "empty (row 0)"}
    assert "first (robot left, row 0)" in messages["again (robot right, limb RF, row 0)"]
    assert "other" not in messages["again (robot right, limb RF, row 0)"]


def test_inactive_rows_are_not_counted():
    problem, _, _, u, _ = glider()
    flag = problem.parameter("flag", default=0.0)
    problem.equality("first", u[0] - u[1])
    problem.equality("again", u[0] - u[1], active=flag)
    assert problem.check(libraries=SQP).is_ok
    lowered = problem.lower()
    parameters = lowered.parameters()
    parameters["flag"] = 1.0
    report = lowered.check(parameters, libraries=SQP)
    assert found(report, "rank") == [("running", "again (row 0)", "")]


def test_a_row_that_repeats_a_chart_is_named():
    problem, _, _, _, _ = glider()
    ground = pq.Chart(2, lambda y: ca.vertcat(y, 0.1 * y[0]))
    foot = problem.variable("foot", 3, role=pq.Role.LOCAL, chart=ground)
    problem.residual("foot", foot)
    problem.equality("on_ground", foot[2] - 0.1 * foot[0])
    ((_, row, _),) = found(problem.check(libraries=SQP), "rank")
    assert row in ("on_ground (row 0)", "foot.chart (row 0)")


def test_negative_curvature_is_named_with_its_term():
    problem, x, _, u, _ = glider()
    problem.cost("fine", ca.cosh(u[0]))
    problem.cost("saddle", x[1] * u[1] - 4 * x[0] ** 2)
    (finding,) = [f for f in problem.check(libraries=SQP).findings if f.kind == "indefinite"]
    assert finding.column == "x[0]"
    assert "'saddle'" in finding.message
    assert "'fine'" not in finding.message


def test_idle_inputs_are_named():
    problem, *_ = glider()
    v, idle = problem.input("v", 1), problem.input("idle", 2)
    y = problem.state("y", 1)
    problem.dynamics(y, y + v)
    problem.inequality("used", idle[0] - 1)
    report = problem.check(libraries=SQP)
    assert found(report, "unused") == [("running", "idle[1]", "")]
    assert ("running", "v[0]", "") in found(report, "scaling")


def test_variables_that_rows_tie_are_not_idle():
    problem, _, _, u, _ = glider()
    rate, copy = problem.input("rate", 1), problem.input("copy", 1)
    problem.link("rate", rate - (u[0] - problem.previous(u)[0]))
    problem.equality("copy", copy - u[1])
    assert not found(problem.check(libraries=SQP), "scaling")


def test_absent_variables_are_not_idle():
    problem, *_ = glider()
    problem.variable("gone", 2, role=pq.Role.ABSENT)
    assert problem.check(libraries=SQP).is_ok


@pytest.mark.parametrize(("factor", "is_wide"), [(1e7, True), (1e3, False)])
def test_rows_of_very_different_sizes_are_told(factor, is_wide):
    problem, _, _, u, _ = glider()
    problem.inequality("force", factor * u[0] - 1, policy=pq.Hard())
    findings = [f for f in problem.check(libraries=SQP).findings if f.kind == "scaling"]
    assert bool(findings) == is_wide
    assert not is_wide or "inequality force" in findings[0].message


def test_wrong_shapes_are_refused():
    lowered = glider()[0].lower()
    with pytest.raises(pq.ProblemError, match=r"trajectory has shape \(6, 3\)"):
        lowered.check(trajectory=np.zeros((6, 3)))
    with pytest.raises(pq.ProblemError, match="not finite"):
        lowered.check(parameters=np.full(lowered.parameters().values.shape, np.nan))


# ---- the parts -----------------------------------------------------------------------------------


def test_differences_know_their_error():
    functions = {
        "smooth": (lambda d: np.array([1e4 * np.sin(3 * d[0] + 1)]), 3e4 * np.cos(1)),
        "offset": (lambda d: np.array([1e9 + d[0]]), 1.0),
        "curved": (lambda d: np.array([np.exp(300 * d[0])]), 300.0),
    }
    for function, slope in functions.values():
        found = differences(function, 1)
        assert abs(found.slope[0, 0] - slope) <= 10 * found.uncertainty[0, 0] + 1e-9
        assert not found.is_broken.any()
    for function in (lambda d: np.abs(d), lambda d: np.maximum(d, -d / 2), lambda d: np.sign(d)):
        assert differences(function, 1).is_broken.all()


def test_a_small_error_in_a_small_row_is_found():
    wrong = Derivative("f", ["a"], ["x"], lambda d: 1e-4 * d, np.array([[1.01e-4]]))
    assert [f.kind for f in faults(wrong, "here")] == ["derivative"]


def test_dependencies_of_combinations():
    rng = np.random.default_rng(0)
    a, b, c = rng.normal(size=(3, 6))
    rows = np.array([a, 1e5 * b, c, 2 * a - 3 * b, np.zeros(6), 1e-6 * c])
    assert dependencies(rows) == [(3, [0, 1]), (4, []), (5, [2])]
