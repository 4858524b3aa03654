"""Every solver on the whole library: its own checks, one optimum, and a KKT certificate."""

import itertools

import numpy as np
import pytest
from support.kkt import WholeHorizon
from support.small_problems import LIBRARY

import palanquin as pq
from palanquin import _core
from palanquin.plan import SQP_PHASES

# Relative cost, plan and KKT residual that a back end reaches at its default settings.
TOLERANCES = {
    "structured": (1e-8, 2e-4, 1e-5),
    "ldl": (1e-8, 2e-4, 1e-5),
    "osqp": (1e-7, 5e-4, 1e-5),
    "ipopt": (0.0, 0.0, 1e-6),
}


def solve(lowered, inputs, solver, form="reduced", **options):
    if solver == "ipopt":
        return pq.Ipopt(lowered, penalize=True).solve(*inputs)
    if solver != "osqp":  # whose own tolerances end sooner
        options = {"cost_tolerance": 1e-12} | options
    return pq.Sqp(lowered, qp=solver, form=form, **options).solve(*inputs)


def takes(solver, problem):
    """Whether a back end takes the problem's rows."""
    return not (solver == "ldl" and problem.has_hard_rows)


CASES = [
    (name, solver)
    for name, solver in itertools.product(LIBRARY, [*_core.qp_solver_names(), "ipopt"])
    if takes(solver, LIBRARY[name])
]


@pytest.fixture(scope="module")
def reference(lowered_once, session_cache):
    """Ipopt's solution of a problem, made once."""
    plans = {}

    def solution(name):
        if name not in plans:
            with pytest.MonkeyPatch.context() as patch:
                patch.setenv("PALANQUIN_CACHE", str(session_cache))
                lowered = lowered_once(name)
                plans[name] = solve(lowered, LIBRARY[name].inputs(lowered), "ipopt")
        return plans[name]

    return solution


@pytest.mark.parametrize(("name", "solver"), CASES)
def test_solution(name, solver, lowered, reference):
    problem, (cost, plan_tolerance, kkt) = LIBRARY[name], TOLERANCES[solver]
    inputs = problem.inputs(lowered(name))
    plan = solve(lowered(name), inputs, solver)
    assert plan.status is pq.Status.CONVERGED, plan.message
    assert plan.is_usable
    problem.check(plan, inputs)
    program = WholeHorizon(problem.build(), inputs.parameters, inputs.measured, plan.trajectory)
    assert program.kkt_residual().max <= kkt
    best = reference(name)
    assert plan.cost == pytest.approx(best.cost, rel=cost, abs=1e-12)
    assert plan.cost == pytest.approx(plan.tracking_cost + plan.penalty_cost)
    assert_same(problem.build().blocks, plan, best, plan_tolerance)


def assert_same(blocks, plan, other, tolerance):
    for block in blocks:
        a, b = plan.trajectory[block.name], other.trajectory[block.name]
        count = len(a) if block.is_state else len(a) - 1
        b = b * np.sign(np.sum(a * b, axis=1, keepdims=True)) if block.is_quaternion else b
        scale = max(1.0, np.abs(b).max())
        np.testing.assert_allclose(a[:count], b[:count], rtol=0, atol=tolerance * scale)


PAPER_FORM = [c for c in CASES if c[1] != "ipopt"]


@pytest.mark.parametrize(("name", "solver"), PAPER_FORM)
def test_paper_form_has_the_same_optimum(name, solver, lowered, reference):
    problem, (cost, _, kkt) = LIBRARY[name], TOLERANCES[solver]
    inputs = problem.inputs(lowered(name))
    plan = solve(lowered(name), inputs, solver, form="paper")
    assert plan.status is pq.Status.CONVERGED, plan.message
    program = WholeHorizon(problem.build(), inputs.parameters, inputs.measured, plan.trajectory)
    assert program.kkt_residual().max <= kkt
    assert plan.cost == pytest.approx(reference(name).cost, rel=cost, abs=1e-12)


@pytest.mark.parametrize("name", LIBRARY)
def test_threads_change_nothing(name, lowered):
    problem = LIBRARY[name]
    inputs = problem.inputs(lowered(name))
    solver = "osqp" if problem.has_hard_rows else "ldl"
    one, two = (solve(lowered(name), inputs, solver, threads=n) for n in (1, 2))
    np.testing.assert_array_equal(one.xs, two.xs)
    assert one.cost == two.cost


def test_solving_twice_gives_the_same_bits(lowered):
    inputs = LIBRARY["RigidBody"].inputs(lowered("RigidBody"))
    solver = pq.Sqp(lowered("RigidBody"), qp="ldl")
    np.testing.assert_array_equal(solver.solve(*inputs).xs, solver.solve(*inputs).xs)


def test_one_curvature_a_step_reaches_the_same_optimum(lowered, reference):
    """The paper's variant: each penalty is its expansion at the iterate."""
    inputs = LIBRARY["Hopper"].inputs(lowered("Hopper"))
    plan = solve(lowered("Hopper"), inputs, "ldl", subproblem={"max_inner_iterations": 1})
    assert plan.is_usable
    assert all(r.inner_iterations == 1 for r in plan.iterations)
    assert plan.cost == pytest.approx(reference("Hopper").cost, rel=1e-6)


def test_real_time_iterations_converge(lowered, reference):
    """One iteration a solve, each from the plan before: as good as one solve to convergence."""
    inputs = LIBRARY["RigidBody"].inputs(lowered("RigidBody"))
    solver = pq.Sqp(lowered("RigidBody"), qp="ldl", max_iterations=1)
    guess = inputs.guess
    for _ in range(8):
        plan = solver.solve(inputs.parameters, inputs.measured, guess)
        guess = plan.trajectory
        assert len(plan.iterations) == 1
    assert plan.cost == pytest.approx(reference("RigidBody").cost, rel=1e-8)


def test_history_and_timings_add_up(lowered):
    inputs = LIBRARY["Unicycle"].inputs(lowered("Unicycle"))
    plan = pq.Sqp(lowered("Unicycle"), qp="ldl").solve(*inputs)
    assert plan.iteration_count == len(plan.iterations)
    last = plan.iterations[-1]
    assert last.cost == plan.tracking_cost
    assert last.penalty == plan.penalty_cost
    assert last.step == "full"
    phases = {k: v for k, v in plan.timings_ms.items() if k != "total"}
    assert set(phases) == set(SQP_PHASES)
    assert sum(phases.values()) == pytest.approx(plan.timings_ms["total"])
    assert sum(r.times.total for r in plan.iterations) == pytest.approx(plan.timings_ms["total"])


# ---- exact Hessians ------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "solver"), [c for c in CASES if c[1] != "ipopt"])
def test_exact_hessians_have_the_same_optimum(name, solver, lowered, reference):
    problem = LIBRARY[name]
    inputs = problem.inputs(lowered(name))
    plan = solve(lowered(name), inputs, solver, hessian="exact")
    assert plan.is_usable, plan.message
    assert plan.cost == pytest.approx(reference(name).cost, rel=1e-5, abs=1e-12)
    problem.check(plan, inputs)


@pytest.mark.parametrize("solver", ["structured", "ldl"])
def test_exact_hessians_converge_quadratically(solver, lowered):
    """Large residuals: Gauss-Newton contracts by a factor, the exact Hessian squares the error."""
    inputs = LIBRARY["LargeResidual"].inputs(lowered("LargeResidual"))
    exact, gauss_newton = (
        solve(lowered("LargeResidual"), inputs, solver, hessian=h)
        for h in ("exact", "gauss_newton")
    )
    assert exact.status is gauss_newton.status is pq.Status.CONVERGED
    assert exact.cost == pytest.approx(gauss_newton.cost, rel=1e-7)
    assert exact.iteration_count <= 6 < gauss_newton.iteration_count
    # The predicted decrease goes with the square of the error: its ratio falls again and again.
    decreases = np.abs([r.predicted for r in exact.iterations])[1:]
    decreases = decreases[decreases > 1e-15]
    orders = np.log(decreases[1:]) / np.log(decreases[:-1])
    assert orders[-1] > 1.6
