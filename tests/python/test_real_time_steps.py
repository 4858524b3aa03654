"""One step a measurement: every plan starts where it was measured, and the loop loses nothing."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest

import palanquin as pq


@dataclass(frozen=True)
class Loop:
    """A plant that its own model controls, pushed by changes of velocity.

    Attributes:
        build: states the problem; its blocks are "x" and "u".
        start: x at time 0.
        pushed: entries of x that a push changes (m/s, rad/s).
        steps: length of the loop.
    """

    build: Callable[[], pq.Problem]
    start: np.ndarray
    pushed: slice
    steps: int = 50

    def pushes(self) -> np.ndarray:
        """Changes of x [steps, nx]: 0.01 to 0.5 in a random direction, at every fifth step."""
        rng = np.random.default_rng(5)
        changes = np.zeros((self.steps, len(self.start)))
        for step in range(5, self.steps, 5):
            direction = rng.normal(size=len(self.start[self.pushed]))
            size = 0.01 * 50 ** rng.uniform()
            changes[step, self.pushed] = size * direction / np.linalg.norm(direction)
        return changes


def problem_of(name, nx, nu, rate, weights, dt, horizon, target=None, start=None):
    """Least squares to a target under x' = rate(x, u), by a Runge-Kutta step an interval."""
    problem = pq.Problem(horizon=horizon, dt=dt, name=name)
    x, u = problem.state("x", nx), problem.input("u", nu)
    k1 = rate(x, u)
    k2 = rate(x + dt / 2 * k1, u)
    k3 = rate(x + dt / 2 * k2, u)
    k4 = rate(x + dt * k3, u)
    problem.dynamics(x, increment=dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
    state_weight, input_weight = weights
    problem.residual("target", x - (0 if target is None else target), state_weight, at="all")
    problem.residual("effort", u - (0 if start is None else start), input_weight)
    return problem


def pendulum():
    """A cart (1 kg) with a pendulum (0.1 kg, 0.8 m); x = cart, angle from the top, and rates."""

    def rate(x, u):
        m, total, length, g = 0.1, 1.1, 0.8, 9.81
        s, c = ca.sin(x[1]), ca.cos(x[1])
        d = total - m * c**2
        cart = (-m * length * s * x[3] ** 2 + m * g * c * s + u[0]) / d
        angle = (-m * length * c * s * x[3] ** 2 + u[0] * c + total * g * s) / (length * d)
        return ca.vertcat(x[2], x[3], cart, angle)

    weights = ([1.0, 10.0, 0.1, 0.1], 0.01)
    problem = problem_of("loop_pendulum", 4, 1, rate, weights, 0.05, 20)
    u = problem.blocks[1].symbol
    limit = ca.vertcat(u - 20, -u - 20)
    problem.inequality("force", limit, policy=pq.Penalty(stiffness=10.0, smoothing=1.0))
    return problem


def chain():
    """Three masses hang between a wall and a hand, on springs that stiffen; the hand moves."""
    links, rest, stiffness, mass, g = 4, 0.2, 30.0, 0.1, 9.81

    def rate(x, u):
        points = [ca.DM([0.0, 0.0]), *(x[2 * i : 2 * i + 2] for i in range(4))]
        pulls = []
        for a, b in itertools.pairwise(points):
            d = b - a
            length = ca.sqrt(ca.sumsqr(d) + 1e-6)
            pulls.append(stiffness * (1 - rest / length) * d)
        accelerations = [
            (pulls[i + 1] - pulls[i]) / mass - ca.DM([0.0, g]) for i in range(links - 1)
        ]
        return ca.vertcat(x[8:14], u, *accelerations)

    target = np.concatenate([[0.25, -0.1, 0.5, -0.13, 0.75, -0.1, 1.0, 0.0], np.zeros(6)])
    weights = ([0.1] * 6 + [10.0] * 2 + [0.1] * 6, 0.05)
    return problem_of("loop_chain", 14, 2, rate, weights, 0.05, 20, target)


def quadrotor():
    """Planar, 1 kg and 0.25 m wide: x, z, tilt, and their rates; two rotors that push."""

    def rate(x, u):
        lift = u[0] + u[1]
        turn = 0.25 * (u[1] - u[0]) / 0.01
        return ca.vertcat(x[3:], -lift * ca.sin(x[2]), lift * ca.cos(x[2]) - 9.81, turn)

    weights = ([1.0, 1.0, 0.1, 0.1, 0.1, 0.01], 1e-3)
    problem = problem_of("loop_quadrotor", 6, 2, rate, weights, 0.04, 20, start=9.81 / 2)
    u = problem.blocks[1].symbol
    problem.inequality("rotor", -u, policy=pq.SquaredHinge(stiffness=10.0))
    return problem


LOOPS = {
    "pendulum": Loop(pendulum, np.array([0.5, 0.3, 0.0, 0.0]), slice(2, 4)),
    "chain": Loop(
        chain,
        np.concatenate([[0.25, -0.15, 0.5, -0.2, 0.7, -0.15, 0.9, 0.1], np.zeros(6)]),
        slice(8, 14),
    ),
    "quadrotor": Loop(quadrotor, np.array([1.0, -1.0, 0.3, 0.0, 0.0, 0.0]), slice(3, 6)),
}


def functions_of(problem):
    """The plant x+ = step(x, u) and the stage's cost, penalties included."""
    x, u = (block.symbol for block in problem.blocks)
    symbols = [x, u]
    step = x + problem.dynamics_of(problem.blocks[0]).expression
    cost = sum(ca.dot(t.weight, t.expression**2) for t in problem.costs if t.at != "terminal")
    return ca.Function("step", symbols, [step]), ca.Function("cost", symbols, [cost])


@pytest.fixture(scope="module", params=LOOPS)
def case(request):
    loop = LOOPS[request.param]
    problem = loop.build()
    return loop, problem.lower(), *functions_of(problem)


def run(case, plan_of):
    """Cost of the loop under the controller `plan_of(measured x, predicted x, guess)`, whose first
    guess has converged: a plant that stands has the time for it."""
    loop, lowered, step, stage_cost = case
    x = loop.start
    guess = pq.Sqp(lowered).solve(lowered.parameters(), knot(lowered, x)).trajectory.copy()
    total = 0.0
    for push in loop.pushes():
        predicted, x = x, x + push
        plan = plan_of(lowered, x, predicted, guess)
        assert plan.is_usable, plan.message
        np.testing.assert_array_equal(plan.trajectory["x"][0], x)
        u = plan.trajectory["u"][0]
        total += float(stage_cost(x, u))
        x = np.array(step(x, u)).ravel()
        guess.values[:-1] = plan.xs[1:]
        guess.values[-1] = plan.xs[-1]
        guess["u"][-2] = guess["u"][-3]
    return total


def knot(lowered, x):
    measured = lowered.knot()
    measured["x"] = x
    return measured


def one_phase(solver):
    def plan(lowered, x, _, guess):
        return solver.solve(lowered.parameters(), knot(lowered, x), guess)

    return plan


def two_phases(solver):
    def plan(lowered, x, predicted, guess):
        assert solver.prepare(lowered.parameters(), knot(lowered, predicted), guess)
        return solver.feedback(knot(lowered, x))

    return plan


@pytest.mark.parametrize("phases", [one_phase, two_phases])
@pytest.mark.parametrize("qp", ["structured", "ldl"])
def test_a_step_a_measurement_costs_what_convergence_costs(case, qp, phases):
    converged = run(case, one_phase(pq.Sqp(case[1], qp=qp)))
    real_time = run(case, phases(pq.Sqp(case[1], qp=qp, max_iterations=1)))
    assert real_time == pytest.approx(converged, rel=1e-2)
