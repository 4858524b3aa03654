"""A plan's derivatives against differences of plans that were solved again."""

import casadi as ca
import numpy as np
import pytest
from support.small_problems import LIBRARY

import palanquin as pq
from palanquin import _core

TIGHT = {"cost_tolerance": 1e-15, "stationarity_tolerance": 1e-10, "max_iterations": 300}
TOLERANCE = 1e-6  # relative to the largest entry of the derivative, or to 1


@pytest.fixture(autouse=True)
def cache(session_cache, monkeypatch):
    monkeypatch.setenv("PALANQUIN_CACHE", str(session_cache))


class Solved:
    """A problem with its converged plan, solved again from there for other inputs."""

    def __init__(self, lowered, parameters, measured, guess, solver=None, **options):
        self.lowered, self.parameters, self.measured = lowered, parameters, measured
        self.solver = solver or pq.Sqp(lowered, **{**TIGHT, **options})
        self.plan = self.solve(parameters, measured, guess)
        self.plan = self.solve(parameters, measured, self.plan.trajectory)

    def solve(self, parameters, measured, guess):
        plan = self.solver.solve(parameters, measured, guess)
        assert plan.status is pq.Status.CONVERGED, plan.message
        return plan

    def slope(self, ahead, behind, h):
        """Of the trajectory, by the arguments of two solves that are 2 h apart."""
        ends = [self.solve(*inputs, self.plan.trajectory).trajectory for inputs in (ahead, behind)]
        return {name: (ends[0][name] - ends[1][name]) / (2 * h) for name in ends[0]}

    def by_measured(self, block, entry, h=1e-5):
        info = next(b for b in self.lowered.core.blocks if b.name == block)
        dz = np.zeros(self.lowered.core.ndz)
        dz[info.tangent_offset + entry] = h
        moved = [_core.retract(self.lowered.core, self.measured.values, d) for d in (dz, -dz)]
        ahead, behind = ((self.parameters, self.lowered.wrap(z)) for z in moved)
        return self.slope(ahead, behind, h)

    def by_parameter(self, name, entry, knots=slice(None), h=1e-5):
        sides = []
        for sign in (1, -1):
            changed = self.parameters.copy()
            view = changed[name].reshape(len(changed.values), -1)
            view[knots, entry] += sign * h
            sides.append((changed, self.measured))
        return self.slope(*sides, h)


def assert_close(found, expected, entry, skip=()):
    scale = max(1.0, *(np.abs(v).max() for v in expected.values()))
    for name in expected:
        if name not in skip:
            np.testing.assert_allclose(
                found[name][..., entry], expected[name], rtol=0, atol=TOLERANCE * scale,
                err_msg=name,
            )  # fmt: skip


# Of states, quaternions, charts and contacts, penalties and hard rows, general costs.
NAMES = [
    "DoubleIntegrator", "BoundedIntegrator", "HardBoundedIntegrator", "TerminalEquality",
    "MoveBlocking", "Unicycle", "Pendulum", "LargeResidual", "ConvexCost", "Spinner", "RigidBody",
    "Hopper",
]  # fmt: skip
FLAGS = ("stance", "stood", "held")
OPTIONS = {"HardBoundedIntegrator": {"stationarity_tolerance": 1e-8, "cost_tolerance": 1e-13}}


@pytest.mark.parametrize("name", NAMES)
def test_derivatives_of_small_problems(name, lowered):
    problem = lowered(name)
    options = {"hessian": "exact", **OPTIONS.get(name, {})}
    solved = Solved(problem, *LIBRARY[name].inputs(problem), **options)
    found = solved.plan.sensitivities()
    for block in problem.core.blocks:
        if block.is_state:
            slopes = found.to_measured(block.name)
            assert slopes[block.name].shape[-1] == block.tangent_size
            for entry in range(block.tangent_size):
                assert_close(slopes, solved.by_measured(block.name, entry), entry)
    for parameter in problem.core.parameters:
        if parameter.name not in FLAGS:
            slopes = found.to_parameter(parameter.name)
            assert_close(slopes, solved.by_parameter(parameter.name, 0), 0)


def servo():
    """Rows over two knots, a constant that is decided, active hard rows, a state of no use."""
    problem = pq.Problem(horizon=8, dt=0.2, name="servo")
    x, u = problem.state("x", 2), problem.input("u", 1)
    duration = problem.constant("duration", lower=0.5, upper=5)
    problem.ode(x, ca.vertcat(x[1], u - ca.sin(x[0])), duration=duration / problem.horizon)
    change = problem.input("change", 1)
    problem.link("change", change - (u - problem.previous(u)))
    problem.residual("effort", ca.vertcat(u, change), weight=[0.1, 0.2])
    problem.cost("duration", duration / problem.horizon)
    problem.bound("push", u, upper=problem.parameter("limit", default=0.8))
    goal = problem.parameter("goal", 2, [1, 0])
    problem.equality("arrival", x - goal, at="terminal")
    lowered = problem.lower()
    guess = lowered.trajectory()
    guess["duration"] = 2.0
    return lowered, lowered.parameters(), lowered.knot(), guess


def test_derivatives_with_links_constants_and_active_rows():
    lowered, *inputs = servo()
    solved = Solved(lowered, *inputs, pq.Ipopt(lowered, tolerance=1e-12))
    assert np.nanmax(solved.plan.multipliers["push"]) > 1e-3
    found = solved.plan.sensitivities()
    for entry in range(2):
        assert_close(found.to_measured("x"), solved.by_measured("x", entry), entry)
        assert_close(found.to_parameter("goal"), solved.by_parameter("goal", entry), entry)
    assert_close(found.to_measured("u"), solved.by_measured("u", 0), 0)
    assert_close(found.to_parameter("limit"), solved.by_parameter("limit", 0), 0)
    assert_close(found.to_parameter("limit", 0), solved.by_parameter("limit", 0, 0), 0)
    assert_close(found.to_parameter("goal", 8), solved.by_parameter("goal", 0, 8), 0)
    np.testing.assert_allclose(found.to_parameter("goal", 3)["x"], 0, atol=1e-12)


def test_ipopts_plans_and_other_forms_have_the_same_derivatives():
    lowered, *inputs = servo()
    reference = pq.Ipopt(lowered).solve(*inputs)
    inputs[-1] = reference.trajectory
    plans = [reference, *(pq.Sqp(lowered, form=f).solve(*inputs) for f in ("reduced", "paper"))]
    first, *others = (plan.sensitivities().to_parameter("goal") for plan in plans)
    for other in others:
        for name in first:
            np.testing.assert_allclose(other[name], first[name], rtol=0, atol=1e-4)


def test_what_has_no_derivatives_says_so():
    lowered, parameters, measured, guess = servo()
    plan = pq.Sqp(lowered, max_iterations=1).solve(parameters, measured, guess)
    with pytest.raises(pq.ProblemError, match="only a converged one has derivatives"):
        plan.sensitivities()
    plan = pq.Ipopt(lowered).solve(parameters, measured, guess)
    with pytest.raises(pq.ProblemError, match="there is no parameter 'aim'; there are dt, "):
        plan.sensitivities().to_parameter("aim")
    with pytest.raises(pq.ProblemError, match="there is no block 'y'; there are x, "):
        plan.sensitivities().to_measured("y")
    with pytest.raises(pq.ProblemError, match="knot is 9; 0 to 8 is needed"):
        plan.sensitivities().to_parameter("goal", 9)
