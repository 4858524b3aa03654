"""The two phases of a real-time iteration, and the gain for controllers faster than the planner."""

from __future__ import annotations

import numpy as np
import pytest

from palanquin import Sqp, _core
from palanquin.problems import clm

pytestmark = pytest.mark.bindings


@pytest.fixture(scope="module")
def planner() -> clm.Planner:
    """Two Laikagos in a trot, settled."""
    team = clm.Team(
        clm.Payload(),
        (clm.Carrier("left", (0.0, 0.6, 0.0)), clm.Carrier("right", (0.0, -0.6, 0.0))),
    )
    planner = clm.Planner(clm.build_clm(team), qp="structured")
    planner.settle(0.0, planner.nominal_state(), clm.Velocity(0.4))
    return planner


def start(planner: clm.Planner):
    """Parameters, measured knot and a settled trajectory."""
    plan = planner.solve(0.0, planner.nominal_state(), clm.Velocity(0.4)).plan
    measured = planner.lowered.knot()
    measured.values[:] = plan.xs[0]
    return planner.params, measured, plan.trajectory


def disturbed(planner: clm.Planner, measured, scale: float):
    """The measured knot with another payload velocity."""
    other = measured.copy()
    other["payload.velocity"] = other["payload.velocity"] + scale * np.array([0.01, -0.02, 0.005])
    return other


@pytest.mark.parametrize("qp", ["structured", "ldl", "osqp"])
def test_two_phases_give_the_plan_of_one(planner: clm.Planner, qp: str) -> None:
    params, measured, guess = start(planner)
    other = disturbed(planner, measured, 1.0)
    inner = {"max_inner_iterations": 20}
    solver = Sqp(planner.lowered, qp=qp, max_iterations=1, subproblem=inner)
    assert solver.prepare(params, measured, guess)
    two = solver.feedback(other)
    assert two.is_usable
    assert two.timings_ms["feedback"] > 0
    one = Sqp(planner.lowered, qp=qp, max_iterations=1, subproblem=inner).solve(
        params, other, guess
    )
    # Linearised at the predicted state or at the measured one: they differ to second order.
    assert two.cost == pytest.approx(one.cost, rel=1e-3)
    assert two.trajectory["payload.velocity"][0] == pytest.approx(other["payload.velocity"])


def test_feedback_needs_a_preparation(planner: clm.Planner) -> None:
    solver = Sqp(planner.lowered, qp="structured")
    with pytest.raises(RuntimeError, match="nothing was prepared"):
        solver.feedback(planner.lowered.knot())


def test_gain_predicts_how_the_first_knot_answers(planner: clm.Planner) -> None:
    params, measured, guess = start(planner)
    solver = Sqp(planner.lowered, qp="structured", max_iterations=1)
    assert solver.prepare(params, measured, guess)
    before = solver.feedback(measured)
    gain = solver.feedback_gain()
    core = planner.lowered.core
    assert gain.shape == (core.ndz, core.ndx)

    scale = 1e-3
    other = disturbed(planner, measured, scale)
    assert solver.prepare(params, measured, guess)
    after = solver.feedback(other)
    # Velocities of the payload are columns 6 to 8: position and rotation come before.
    change = gain[:, 6:9] @ (other["payload.velocity"] - measured["payload.velocity"])
    predicted = _core.retract(core, before.xs[0], change)
    answered = np.abs(after.xs[0] - before.xs[0])
    states = planner.columns.bodies.ravel()
    inputs = np.setdiff1d(np.arange(core.nz), states)
    error = np.abs(after.xs[0] - predicted)[inputs]
    assert answered[inputs].max() > 1e-3
    assert error.max() < 1e-3 * answered[inputs].max()


def test_other_back_ends_give_no_gain(planner: clm.Planner) -> None:
    params, measured, guess = start(planner)
    solver = Sqp(planner.lowered, qp="ldl", max_iterations=1)
    solver.solve(params, measured, guess)
    assert solver.feedback_gain().size == 0
