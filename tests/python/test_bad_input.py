"""Input that no solver can use: refused with a message that names it, or answered by a status."""

import re

import casadi as ca
import numpy as np
import pytest
from support.small_problems import LIBRARY

import palanquin as pq

pytestmark = pytest.mark.bindings

HORIZON = LIBRARY["RigidBody"].N


@pytest.fixture
def body(lowered):
    return lowered("RigidBody")


@pytest.fixture
def inputs(body):
    return LIBRARY["RigidBody"].inputs(body)


@pytest.fixture(params=["sqp", "ipopt"])
def solver(request, body):
    return pq.Ipopt(body) if request.param == "ipopt" else pq.Sqp(body, qp="ldl")


# ---- names and options ---------------------------------------------------------------------------


def test_unknown_names_list_the_known_ones(body, inputs):
    with pytest.raises(pq.ProblemError, match=r"no parameter 'masss'; there are dt, mass, target"):
        inputs.parameters["masss"] = 1.0
    with pytest.raises(pq.ProblemError, match=r"no block 'foot'; there are position, orientation"):
        inputs.measured["foot"]
    with pytest.raises(ValueError, match=r"no inequality family 'lane'"):
        pq.Sqp(body, qp="ldl").set_policy("lane", pq.Penalty())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"iterations": 3}, "SqpSettings has no field 'iterations'; it has .*max_iterations"),
        (
            {"subproblem": {"steps": 3}},
            "no field 'steps'; it has decrease_tolerance, max_inner_iterations",
        ),
        ({"subproblem": 3}, r"SqpSettings.subproblem is 3, a int; a SubproblemSettings is needed"),
        ({"qp": {"name": "ldl"}}, "SqpSettings.qp is .*, a dict; a str is needed"),
        (
            {"max_iterations": "many"},
            "SqpSettings.max_iterations is 'many', a str; a int is needed",
        ),
        ({"form": "short"}, "form is 'short'; it must be one of reduced, paper"),
        (
            {"hessian": "full"},
            "hessian is 'full'; it must be one of gauss_newton, exact, automatic",
        ),
    ],
)
def test_unknown_options(body, options, message):
    with pytest.raises(pq.ProblemError, match=message):
        pq.Sqp(body, **options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"qp": "cholmod"}, "cholmod"),
        ({"threads": 0}, "sqp.threads is 0, but must be at least 1"),
        ({"max_iterations": 0}, "sqp.max_iterations is 0, but must be at least 1"),
        ({"cost_tolerance": float("nan")}, "sqp.cost_tolerance is nan, but must be finite"),
        ({"damping": {"first": -1.0}}, "damping.first is -1"),
        ({"restoration": {"certificate": 2.0}}, "restoration.certificate is 2"),
        ({"usable_violation": 0.0}, "sqp.usable_violation is 0"),
        ({"stationarity_tolerance": 0.0}, "sqp.stationarity_tolerance is 0"),
        ({"line_search": {"contraction": 1.0}}, r"line_search.contraction is 1, .*in \(0, 1\)"),
        ({"line_search": {"min_step": 0.0}}, "line_search.min_step is 0"),
        ({"subproblem": {"max_inner_iterations": 0}}, "subproblem.max_inner_iterations is 0"),
        ({"qp_settings": {"osqp": {"rho": 0.0}}}, "osqp.rho is 0"),
    ],
)
def test_invalid_settings(body, options, message):
    with pytest.raises(ValueError, match=message):
        pq.Sqp(body, **options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"tolerance": 0.0}, "ipopt.tolerance is 0"),
        ({"max_iterations": 0}, "ipopt.max_iterations is 0"),
        ({"print_level": 13}, "ipopt.print_level is 13, but must be 0 to 12"),
    ],
)
def test_invalid_ipopt_settings(body, options, message):
    with pytest.raises(ValueError, match=message):
        pq.Ipopt(body, **options)


@pytest.mark.parametrize("horizon", [0, -3, 2.5, True])
def test_bad_horizon(body, horizon):
    with pytest.raises(pq.ProblemError, match="must be an integer of at least 1"):
        pq.Sqp(body, qp="ldl", horizon=horizon)
    with pytest.raises(pq.ProblemError, match="must be an integer of at least 1"):
        body.parameters(horizon)


# ---- arrays --------------------------------------------------------------------------------------


def test_values_that_do_not_fit(inputs):
    with pytest.raises(
        pq.ProblemError, match=r"'target' has shape \(3,\); .* broadcast to \(16, 4\)"
    ):
        inputs.parameters["target"] = [1.0, 0.0, 0.0]
    with pytest.raises(pq.ProblemError, match=r"parameter 'mass' holds a value that is not finite"):
        inputs.parameters["mass"] = np.inf
    with pytest.raises(pq.ProblemError, match="block 'spin' holds a value that is not finite"):
        inputs.measured["spin"] = [0.0, np.nan, 0.0]


def test_wrong_shapes(solver, body, inputs):
    parameters, measured, guess = inputs
    short = body.parameters(HORIZON - 1)
    with pytest.raises(ValueError, match=r"parameters have shape \[15, 6\]; \[16, 6\] is needed"):
        solver.solve(short, measured, guess)
    with pytest.raises(ValueError, match="measured knot has 3 entries; 19 are needed"):
        solver.solve(parameters, measured.values[:3], guess)
    with pytest.raises(ValueError, match=r"trajectory has shape \[8, 19\]; \[16, 19\] is needed"):
        solver.solve(parameters, measured, body.trajectory(7))


def test_values_that_are_not_finite(solver, inputs):
    parameters, measured, guess = inputs
    bad = parameters.copy()
    bad["mass"][4] = np.nan
    with pytest.raises(ValueError, match="parameter 'mass' at knot 4 holds a value that is not"):
        solver.solve(bad, measured, guess)
    bad = measured.copy()
    bad["velocity"][1] = np.inf
    with pytest.raises(ValueError, match="measured 'velocity' holds a value that is not finite"):
        solver.solve(parameters, bad, guess)


def test_guess_that_is_not_finite(solver, inputs):
    inputs.guess["torque"][3, 1] = np.nan
    plan = solver.solve(*inputs)
    assert plan.status is pq.Status.NON_FINITE
    assert not plan.is_usable
    assert "knot 3" in plan.message


def test_quaternions_of_norm_zero(solver, inputs):
    bad = inputs.measured.copy()
    bad["orientation"] = 0.0
    with pytest.raises(ValueError, match="measured 'orientation' is a quaternion of norm zero"):
        solver.solve(inputs.parameters, bad, inputs.guess)
    inputs.guess["orientation"][5] = 0.0
    with pytest.raises(ValueError, match="'orientation' at knot 5 is a quaternion of norm zero"):
        solver.solve(*inputs)


@pytest.mark.parametrize("dt", [0.0, -0.1])
def test_time_steps_are_positive(solver, inputs, dt):
    inputs.parameters["dt"][2] = dt
    with pytest.raises(pq.ProblemError, match=rf"parameter 'dt' is {dt} at knot 2"):
        solver.solve(*inputs)


def test_role_that_does_not_exist(lowered, tmp_path, monkeypatch):
    problem = pq.Problem(horizon=3, dt=0.1, name="roles")
    x = problem.state("x", 1)
    problem.dynamics(x, x)
    problem.variable("foot", 2, role=problem.parameter("role"))
    compiled = problem.lower()
    parameters = compiled.parameters()
    for code in (5.0, -1.0, 0.5, float(pq.Role.STATE)):
        parameters["role"][1] = code
        with pytest.raises(ValueError, match=r"role of 'foot' at knot 1 is .*0 \(input\), 1 \(car"):
            pq.Sqp(compiled, qp="ldl").solve(parameters, compiled.knot())


def test_solver_survives_misuse(solver, inputs):
    with pytest.raises(ValueError, match="measured knot has"):
        solver.solve(inputs.parameters, inputs.measured.values[:3], inputs.guess)
    assert solver.solve(*inputs).status is pq.Status.CONVERGED


# ---- rows that a back end does not take ----------------------------------------------------------


def test_hard_rows_need_a_back_end_that_takes_them(lowered):
    inputs = LIBRARY["HardBoundedIntegrator"].inputs(lowered("HardBoundedIntegrator"))
    solver = pq.Sqp(lowered("HardBoundedIntegrator"), qp="ldl")
    message = r"'ldl' does not take hard inequalities such as upper \(row 0, knot 0\).*'osqp'"
    with pytest.raises(ValueError, match=message):
        solver.solve(*inputs)
    for family in ("upper", "lower"):
        solver.set_policy(family, pq.Penalty(stiffness=1e3))
    assert solver.solve(*inputs).is_usable


# ---- functions that are not finite ---------------------------------------------------------------


def brittle():
    """Logarithms and roots whose arguments are parameters of the test."""
    problem = pq.Problem(horizon=4, dt=0.1, name="brittle")
    x, u = problem.state("x", 1), problem.input("u", 1)
    flow, level, depth, slip, goal, root = (
        problem.parameter(name, default=1.0)
        for name in ("flow", "level", "depth", "slip", "goal", "root")
    )
    problem.dynamics(x, increment=problem.dt * (u + ca.log(flow)))
    problem.residual("effort", u)
    problem.residual("level", ca.log(level) + 0 * x)
    problem.inequality("depth", x - ca.log(depth) - 5, robot="left", limb="LF")
    problem.equality("slip", ca.log(slip) * u, active=problem.parameter("slips"))
    problem.residual("goal", x - ca.log(goal), at="terminal")
    problem.inequality("root", ca.sqrt(u**2 + root) - 3)
    return problem


@pytest.fixture(scope="module")
def brittle_lowered(session_cache):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PALANQUIN_CACHE", str(session_cache))
        lowered = brittle().lower()
        lowered.library("nlp")
        return lowered


@pytest.mark.parametrize("kind", ["sqp", "ipopt"])
@pytest.mark.parametrize(
    ("parameter", "value", "knot", "message"),
    [
        ("flow", -1.0, 2, r"function 'running' is not finite in dynamics of x\[0\] \(knot 2\)"),
        ("level", -1.0, 1, r"function 'running' is not finite in the cost \(knot 1\)"),
        ("depth", -1.0, 3, r"'running' .* in depth \(robot left, limb LF, row 0, knot 3\)"),
        ("slip", -1.0, 0, r"'running' is not finite in slip \(row 0, knot 0\)"),
        ("goal", 0.0, 4, r"function 'terminal' is not finite in the cost \(knot 4\)"),
        ("root", 0.0, 2, r"'running_linear' .* in the derivative of root \(row 0, knot 2\)"),
    ],
)
def test_functions_that_are_not_finite(brittle_lowered, kind, parameter, value, knot, message):
    solver = pq.Ipopt(brittle_lowered) if kind == "ipopt" else pq.Sqp(brittle_lowered, qp="ldl")
    parameters = brittle_lowered.parameters()
    parameters[parameter][knot] = value
    parameters["slips"] = parameter == "slip"
    plan = solver.solve(parameters, brittle_lowered.knot())
    assert plan.status is pq.Status.NON_FINITE
    assert not plan.is_usable
    assert re.search(message, plan.message), plan.message
    parameters[parameter] = 1.0
    assert solver.solve(parameters, brittle_lowered.knot()).is_usable


def test_rows_that_are_not_active_may_be_anything(brittle_lowered):
    parameters = brittle_lowered.parameters()
    parameters["slip"] = -1.0
    plan = pq.Sqp(brittle_lowered, qp="ldl").solve(parameters, brittle_lowered.knot())
    assert plan.status is pq.Status.CONVERGED


# ---- problems without a solution -----------------------------------------------------------------


def contradiction():
    """Two rows of one knot ask for u = 1 and u = 2; everything else can be had."""
    problem = pq.Problem(horizon=4, dt=0.1, name="contradiction")
    x, u = problem.state("x", 1), problem.input("u", 1)
    problem.dynamics(x, increment=problem.dt * u)
    problem.residual("effort", u)
    here = problem.parameter("here")
    problem.equality("one", u - 1, active=here, robot="left", limb="LF")
    problem.equality("two", u - 2, active=here, robot="left", limb="RH")
    return problem


def out_of_reach():
    """Hard bounds |u| <= 1 and x_N >= 1, with 0.4 s to go from 0."""
    problem = pq.Problem(horizon=4, dt=0.1, name="out_of_reach")
    x, u = problem.state("x", 1), problem.input("u", 1)
    problem.dynamics(x, increment=problem.dt * u)
    problem.residual("effort", u)
    problem.inequality("bounds", ca.vertcat(u - 1, -u - 1), policy=pq.Hard())
    problem.inequality("arrival", 1 - x, policy=pq.Hard(), at="terminal", robot="left")
    return problem


@pytest.mark.parametrize("kind", ["structured", "ldl", "osqp", "ipopt"])
def test_contradicting_rows(lowered, kind):
    compiled = contradiction().lower()
    parameters = compiled.parameters()
    parameters["here"][2] = 1.0
    solver = pq.Ipopt(compiled) if kind == "ipopt" else pq.Sqp(compiled, qp=kind)
    plan = solver.solve(parameters, compiled.knot())
    assert plan.status is pq.Status.INFEASIBLE, plan.message
    assert not plan.is_usable
    worst = plan.worst_rows(2)
    names = {name for name, _ in worst}
    assert names <= {
        "one (robot left, limb LF, row 0, knot 2)",
        "two (robot left, limb RH, row 0, knot 2)",
    }
    assert worst[0][1] >= 0.5
    assert worst[0][0].split(" ")[0] in plan.message
    # The same solver goes on when the rows are gone.
    assert solver.solve(compiled.parameters(), compiled.knot()).status is pq.Status.CONVERGED


@pytest.mark.parametrize("kind", ["osqp", "ipopt"])
def test_hard_inequalities_that_cannot_hold(lowered, kind):
    compiled = out_of_reach().lower()
    solver = pq.Ipopt(compiled) if kind == "ipopt" else pq.Sqp(compiled, qp=kind)
    plan = solver.solve(compiled.parameters(), compiled.knot())
    assert plan.status is pq.Status.INFEASIBLE, plan.message
    assert not plan.is_usable
    names = [name for name, _ in plan.worst_rows(9)]
    assert "arrival (robot left, row 0, knot 4)" in names
    assert plan.violation["arrival"] > 0.1


def test_penalties_turn_the_impossible_into_a_compromise(lowered):
    compiled = out_of_reach().lower()
    solver = pq.Sqp(compiled, qp="ldl")
    solver.set_policy("bounds", pq.Penalty(stiffness=1e3))
    solver.set_policy("arrival", pq.Penalty(stiffness=1e3))
    plan = solver.solve(compiled.parameters(), compiled.knot())
    assert plan.status is pq.Status.CONVERGED
    assert plan.violation["arrival"] > 0.1
    assert plan.worst_rows(1)[0][1] == pytest.approx(plan.violation["arrival"], rel=0.5)


@pytest.mark.parametrize(
    "solver",
    [pq.Sqp, lambda lowered: pq.Sqp(lowered, qp="ldl", form="paper"), pq.Ipopt],
    ids=["reduced", "paper", "ipopt"],
)
def test_a_local_block_in_the_dynamics(solver):
    problem = pq.Problem(horizon=3, dt=0.1, name="local_in_dynamics")
    x = problem.state("x", 2)
    u = problem.variable("u", 1, role=pq.Role.LOCAL)
    problem.dynamics(x, increment=problem.dt * ca.vertcat(x[1], u))
    problem.residual("effort", u)
    lowered = problem.lower()
    with pytest.raises(ValueError, match="block 'u' is local at knot 0, but the dynamics depend"):
        solver(lowered).solve(lowered.parameters(), lowered.knot())
