"""A solver that meets a second thread or a forked process: right plans, or an error in words."""

from __future__ import annotations

import os
import signal
import threading
import warnings

import numpy as np
import pytest
from support.small_problems import LIBRARY

import palanquin as pq

RULE = "another thread uses this solver; a solver serves one thread at a time"


@pytest.fixture
def hopper(lowered):
    return lowered("Hopper")


@pytest.fixture
def inputs(hopper):
    return LIBRARY["Hopper"].inputs(hopper)


def raced(*works):
    """What each of the works gave, run together: results, and the words of errors."""
    start, results = threading.Barrier(len(works)), [[] for _ in works]

    def run(work, found):
        start.wait()
        for _ in range(60):
            try:
                found.append(work())
            except RuntimeError as error:
                found.append(str(error))

    threads = [threading.Thread(target=run, args=pair) for pair in zip(works, results, strict=True)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return results


@pytest.mark.parametrize("options", [{"qp": "ldl"}, {"qp": "structured", "threads": 2}])
def test_two_threads_get_their_own_plans_or_an_error(hopper, inputs, options):
    solver = pq.Sqp(hopper, **options)
    parameters, measured, guess = inputs
    other = parameters.copy()
    other["goal"] += 0.2
    expected = [pq.Sqp(hopper, **options).solve(p, measured, guess).xs for p in (parameters, other)]
    results = raced(
        lambda: solver.solve(parameters, measured, guess).xs,
        lambda: solver.solve(other, measured, guess).xs,
    )
    for found, right in zip(results, expected, strict=True):
        for answer in found:
            assert RULE in answer if isinstance(answer, str) else np.array_equal(answer, right)
    assert np.array_equal(solver.solve(*inputs).xs, expected[0])  # and it goes on


def test_getters_beside_a_solve_answer_or_refuse(hopper, inputs):
    solver = pq.Sqp(hopper, qp="structured")
    expected = solver.solve(*inputs).xs
    getters = (
        lambda: solver.latest,
        lambda: solver.message,
        lambda: solver.model_cost,
        lambda: solver.feedback_gain(),
        lambda: solver.dynamics_multipliers,
        lambda: solver.times_ms,
        lambda: solver.is_usable,
        lambda: solver.set_policy("reach", hopper.policies["reach"]),
    )
    for getter in getters:
        solved, read = raced(lambda: solver.solve(*inputs).xs, getter)
        for answer in solved:
            assert RULE in answer if isinstance(answer, str) else np.array_equal(answer, expected)
        for answer in read:
            # Multipliers of carried blocks have no row, which the getter says too.
            known = not isinstance(answer, str) or RULE in answer or "carries blocks" in answer
            assert known or getter() == answer


def test_two_phases_of_two_threads(hopper, inputs):
    solver = pq.Sqp(hopper, qp="structured")
    parameters, measured, guess = inputs
    assert solver.prepare(*inputs)
    expected = solver.feedback(measured).xs
    one, two = raced(
        lambda: solver.prepare(parameters, measured, guess), lambda: solver.feedback(measured).xs
    )
    assert all(answer is True or RULE in answer for answer in one)
    for answer in two:
        if isinstance(answer, str):
            assert RULE in answer or "nothing was prepared" in answer
        else:
            assert np.array_equal(answer, expected)


def test_ipopt_in_two_threads(lowered):
    body = lowered("RigidBody")
    inputs = LIBRARY["RigidBody"].inputs(body)
    solver = pq.Ipopt(body, max_iterations=3)
    expected = solver.solve(*inputs).xs
    for found in raced(*[lambda: solver.solve(*inputs).xs] * 2):
        for answer in found:
            assert RULE in answer if isinstance(answer, str) else np.array_equal(answer, expected)


# ---- forked processes ----------------------------------------------------------------------------


def in_a_fork(work):
    """Whether `work()` is true in a forked process; one that hangs is ended."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of forking beside threads
        child = os.fork()
    if child == 0:
        signal.alarm(120)
        code = 2
        try:
            code = 0 if work() else 1
        finally:
            os._exit(code)
    return os.waitpid(child, 0)[1] == 0


@pytest.mark.parametrize("qp", ["structured", "ldl", "osqp"])
def test_a_solver_with_threads_works_in_a_fork(hopper, inputs, qp):
    solver = pq.Sqp(hopper, qp=qp, threads=3)
    expected = solver.solve(*inputs).xs

    def is_same():  # OSQP starts from where it was
        return np.allclose(solver.solve(*inputs).xs, expected, atol=1e-3)

    assert in_a_fork(lambda: is_same() and is_same())
    assert is_same()


def test_a_prepared_step_goes_on_in_a_fork(hopper, inputs):
    solver = pq.Sqp(hopper, qp="structured", threads=2)
    expected = solver.prepare(*inputs) and solver.feedback(inputs.measured).xs
    assert solver.prepare(*inputs)
    assert in_a_fork(lambda: np.array_equal(solver.feedback(inputs.measured).xs, expected))


def test_a_fork_may_throw_solvers_away(hopper, inputs):
    solvers = [pq.Sqp(hopper, qp="ldl", threads=2)]
    solvers[0].solve(*inputs)

    def child():
        solvers.clear()
        return pq.Sqp(hopper, qp="ldl", threads=2).solve(*inputs).is_usable

    assert in_a_fork(child)


def test_candidates_work_in_a_fork(hopper, inputs):
    parameters, measured, guess = inputs
    candidates = pq.Candidates(hopper, 2, qp="ldl")
    expected = candidates.solve(parameters, measured, [guess, guess]).plan.xs

    def child():
        plan = candidates.solve(parameters, measured, [guess, guess]).plan
        return np.array_equal(plan.xs, expected)

    assert in_a_fork(child)


# ---- candidates ----------------------------------------------------------------------------------


def test_an_exception_leaves_candidates_in_order(hopper, inputs):
    parameters, measured, guess = inputs
    candidates = pq.Candidates(hopper, 4, threads=2, qp="ldl")
    expected = candidates.solve(parameters, measured, [guess] * 4).plan.xs
    bad = guess.copy()
    bad.values[2] = 0.0
    short = hopper.wrap(guess.values[:-1])
    for broken in ([short, guess, guess, guess], [guess, short, guess, short]):
        with pytest.raises(ValueError, match="trajectory has shape"):
            candidates.solve(parameters, measured, broken)
        assert np.array_equal(candidates.solve(parameters, measured, [guess] * 4).plan.xs, expected)
