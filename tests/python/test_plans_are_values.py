"""A plan says the same whenever and wherever it is read, and looks failed when it has failed."""

from __future__ import annotations

import copy
import pickle
import threading

import numpy as np
import pytest
from support.small_problems import LIBRARY

import palanquin as pq
from palanquin import _core

NAMES = ["Hopper", "RigidBody", "MoveBlocking"]


def inputs_of(name, lowered):
    return LIBRARY[name].inputs(lowered)


def solver_of(name, lowered, **options):
    return pq.Sqp(lowered, **({"qp": "ldl"} | options))


def said(plan):
    """All that a plan says of itself."""
    return (
        plan.violation,
        plan.worst_rows(20),
        plan.cost,
        plan.tracking_cost,
        plan.penalty_cost,
        plan.equality_violation,
        plan.status,
        plan.message,
        plan.is_usable,
        plan.xs.tolist(),
    )


def later(inputs):
    """Parameters one knot later, so that roles move along the horizon, and another guess."""
    parameters = inputs.parameters.copy()
    parameters.values[:-1] = parameters.values[1:]
    return parameters, inputs.measured, inputs.guess


# ---- plans outlive their solver's state ----------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_an_old_plan_stays_what_it_was(lowered, name):
    problem = lowered(name)
    inputs = inputs_of(name, problem)
    solver = solver_of(name, problem, max_iterations=2)
    expected = said(solver_of(name, problem, max_iterations=2).solve(*inputs))
    plan = solver.solve(*inputs)
    solver.solve(*later(inputs))
    for row in next(iter(problem.policies.items()), ())[:1]:
        solver.set_policy(row, pq.Penalty(stiffness=7.0))
    assert said(plan) == expected
    del solver
    assert said(plan) == expected


@pytest.mark.parametrize("qp", ["ldl", "structured"])
def test_an_old_plan_may_be_read_between_two_phases(lowered, qp):
    problem = lowered("Hopper")
    inputs = inputs_of("Hopper", problem)
    solver, quiet = (pq.Sqp(problem, qp=qp) for _ in range(2))
    old = solver.solve(*inputs)
    quiet.solve(*inputs)
    parameters, measured, guess = later(inputs)
    for one in (solver, quiet):
        assert one.prepare(parameters, measured, guess)
    assert old.worst_rows(3) is not None
    assert set(old.violation) == {"friction", "push", "reach"}
    problem.evaluate(guess, parameters, measured)
    plan, expected = solver.feedback(measured), quiet.feedback(measured)
    assert said(plan) == said(expected)


def test_a_viewer_does_not_disturb_the_solver(lowered):
    problem = lowered("Hopper")
    inputs = inputs_of("Hopper", problem)
    solver = solver_of("Hopper", problem)
    turns = [inputs, later(inputs)]
    expected = [said(solver.solve(*turn)) for turn in turns]
    shown, done, seen = [solver.solve(*inputs)], threading.Event(), []

    def view():
        while not done.is_set():
            plan = shown[0]
            seen.append((plan.violation, plan.worst_rows(20)))

    viewer = threading.Thread(target=view)
    viewer.start()
    try:
        for n in range(60):
            plan = solver.solve(*turns[n % 2])
            shown[0] = plan
            assert said(plan) == expected[n % 2]
    finally:
        done.set()
        viewer.join()
    assert all(read in [(e[0], e[1]) for e in expected] for read in seen)


def test_ipopt_plans_are_values_too(lowered):
    problem = lowered("RigidBody")
    inputs = inputs_of("RigidBody", problem)
    solver = pq.Ipopt(problem, penalize=True)
    plan = solver.solve(*inputs)
    expected = said(plan)
    solver.solve(*later(inputs))
    assert said(plan) == expected


# ---- policies between two phases -----------------------------------------------------------------


@pytest.mark.parametrize("policy", [pq.Penalty(stiffness=3.0), pq.Hard()])
def test_a_policy_counts_from_the_next_solve_on(lowered, policy):
    problem = lowered("Hopper")
    inputs = inputs_of("Hopper", problem)
    solver, quiet = (pq.Sqp(problem, qp="osqp" if policy.kind == 0 else "ldl") for _ in range(2))
    for one in (solver, quiet):
        assert one.prepare(*inputs)
    solver.set_policy("friction", policy)
    plan, expected = solver.feedback(inputs.measured), quiet.feedback(inputs.measured)
    assert said(plan) == said(expected)
    quiet.set_policy("friction", policy)
    assert said(solver.solve(*inputs)) == said(quiet.solve(*inputs))


def test_a_solve_between_two_phases_takes_the_preparation_away(lowered):
    problem = lowered("Hopper")
    inputs = inputs_of("Hopper", problem)
    solver = solver_of("Hopper", problem)
    assert solver.prepare(*inputs)
    with pytest.raises(RuntimeError, match="waits for its feedback"):
        solver.feedback_gain()
    solver.solve(*later(inputs))
    with pytest.raises(RuntimeError, match="nothing was prepared"):
        solver.feedback(inputs.measured)


# ---- copies --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("way", ["pickle", "copy", "deepcopy"])
def test_plans_pickle_and_copy(lowered, name, way):
    problem = lowered(name)
    plan = solver_of(name, problem, max_iterations=2).solve(*inputs_of(name, problem))
    ways = {
        "pickle": lambda p: pickle.loads(pickle.dumps(p)),
        "copy": copy.copy,
        "deepcopy": copy.deepcopy,
    }
    again = ways[way](plan)
    assert said(again) == said(plan)
    assert again.timings_ms == plan.timings_ms
    steps = [(r.step, r.cost, r.qp_status, r.times.total) for r in plan.iterations]
    assert [(r.step, r.cost, r.qp_status, r.times.total) for r in again.iterations] == steps
    assert said(pickle.loads(pickle.dumps(again))) == said(plan)


# ---- evaluating any trajectory -------------------------------------------------------------------


def test_evaluation_is_that_of_the_plan(lowered):
    problem = lowered("Hopper")
    parameters, measured, guess = inputs_of("Hopper", problem)
    plan = solver_of("Hopper", problem).solve(parameters, measured, guess)
    at = problem.evaluate(plan.trajectory, parameters, measured)
    assert (at.cost, at.violation) == (plan.cost, plan.violation)
    hard = problem.evaluate(
        plan.trajectory, parameters, measured, {"friction": pq.Hard(), "reach": pq.Hard()}
    )
    assert hard.penalty_cost < at.penalty_cost
    assert 0 <= hard.hard_violation <= max(plan.violation["friction"], plan.violation["reach"])


@pytest.mark.parametrize(
    ("which", "change", "message"),
    [
        (0, lambda a: a[:2, :3], r"\[2, 3\]"),
        (2, lambda a: a[:, :2], r"trajectory has shape \[13, 2\]; \[13, 12\] is needed"),
        (2, lambda a: a[:4], r"parameters have shape \[13, \d+\]; \[4, \d+\] is needed"),
        (1, lambda a: a[:-1], "the measured knot has"),
    ],
)
def test_wrong_shapes_are_refused(lowered, which, change, message):
    problem = lowered("Hopper")
    arrays = [np.array(a.values) for a in inputs_of("Hopper", problem)]
    arrays[which] = change(arrays[which])
    parameters, measured, trajectory = arrays
    with pytest.raises(ValueError, match=message):
        problem.evaluate(trajectory, parameters, measured)


def test_penalty_models_of_another_qp_are_refused(lowered):
    hopper, body = lowered("Hopper"), lowered("RigidBody")
    first, second = (
        _core.StageQpSource().at(problem.snapshot(guess, parameters, measured))
        for name, problem in (("Hopper", hopper), ("RigidBody", body))
        for parameters, measured, guess in [inputs_of(name, problem)]
    )
    model, solution = _core.PenaltyModel(first), _core.StageQpSolution(first)
    solver = _core.make_qp_solver("ldl")
    with pytest.raises(ValueError, match="the penalty model is of another QP"):
        solver.solve(second, model, solution)
    parameters, measured, _ = inputs_of("Hopper", hopper)
    with pytest.raises(ValueError, match="trajectory has shape"):
        hopper.snapshot(body.trajectory(), parameters, measured)


# ---- failed plans look failed --------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["sqp", "ipopt"])
def test_non_finite_plans_have_no_numbers(lowered, kind):
    problem = lowered("RigidBody")
    inputs = inputs_of("RigidBody", problem)
    inputs.guess["torque"][3, 1] = np.nan
    solver = pq.Ipopt(problem) if kind == "ipopt" else solver_of("RigidBody", problem)
    for plan in (solver.solve(*inputs), pickle.loads(pickle.dumps(solver.solve(*inputs)))):
        assert plan.status is pq.Status.NON_FINITE
        assert not plan.is_usable
        assert np.isnan([plan.cost, plan.tracking_cost, plan.equality_violation]).all()
        assert np.isnan(list(plan.violation.values())).all()


def test_a_value_that_is_no_number_is_the_worst_row(lowered):
    problem = lowered("Hopper")
    parameters, measured, guess = inputs_of("Hopper", problem)
    guess["position"][4, 0] = np.nan
    at = problem.evaluate(guess, parameters, measured)
    assert np.isnan([at.cost, at.equality_violation]).all()
    assert np.isnan(at.violation["reach"])
    assert np.isnan(at.worst_rows(1)[0][1])
    hard = problem.evaluate(guess, parameters, measured, {"reach": pq.Hard()})
    assert np.isnan(hard.hard_violation)


def far_jump():
    """x+ = x + u with the cost of going from 0 to 20 in one bounded step: residuals stay."""
    problem = pq.Problem(horizon=2, dt=1.0, name="far_jump")
    x, u = problem.state("x", 1), problem.input("u", 1)
    problem.dynamics(x, increment=u + 0.5 * u**2)
    problem.residual("effort", u, weight=1e-4)
    problem.residual("goal", x - problem.parameter("goal"), weight=1.0, at="all")
    return problem.lower()


def test_a_plan_with_large_residuals_is_not_usable():
    lowered = far_jump()
    parameters, guess = lowered.parameters(), lowered.trajectory()
    parameters["goal"] = 40.0
    options = {"qp": "ldl", "max_iterations": 1, "globalize": False}
    plan = pq.Sqp(lowered, **options).solve(parameters, lowered.knot(), guess)
    assert plan.status is pq.Status.UNFINISHED
    assert plan.equality_violation > 10
    assert not plan.is_usable
    tolerant = pq.Sqp(lowered, **options, usable_violation=1e6)
    assert tolerant.solve(parameters, lowered.knot(), guess).is_usable
    assert tolerant.is_usable


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan")])
def test_the_tolerance_of_usable_plans_is_checked(lowered, value):
    for solver in (pq.Sqp, pq.Ipopt):
        with pytest.raises(ValueError, match="usable_violation"):
            solver(lowered("RigidBody"), usable_violation=value)


# ---- settings ------------------------------------------------------------------------------------


def test_solvers_that_share_settings_do_not_meet(lowered):
    problem = lowered("RigidBody")
    shared = _core.SqpSettings()
    first = pq.Sqp(problem, shared, qp="ldl", subproblem={"max_inner_iterations": 3})
    second = pq.Sqp(problem, shared, max_iterations=7)
    assert (shared.qp, shared.max_iterations) == ("structured", 200)
    assert shared.subproblem.max_inner_iterations != 3
    assert (first.settings.qp, second.settings.qp) == ("ldl", "structured")
    assert second.settings.subproblem.max_inner_iterations != 3
    changed = pq.configure(shared, qp_settings={"osqp": {"rho": 0.5}})
    assert changed.qp_settings.osqp.rho == 0.5
    assert shared.qp_settings.osqp.rho != 0.5


def test_refused_options_leave_settings_alone(lowered):
    shared = _core.IpoptSettings()
    with pytest.raises(pq.ProblemError, match="no field"):
        pq.Ipopt(lowered("RigidBody"), shared, print_level=5, nonsense=1)
    assert shared.print_level == 0
