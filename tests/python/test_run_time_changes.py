"""What may change between two solves of one solver, and plans as warm starts."""

import copy
import pickle

import numpy as np
import pytest
from support.kkt import WholeHorizon
from support.manifold import rotation
from support.small_problems import LIBRARY

import palanquin as pq

pytestmark = pytest.mark.bindings


@pytest.fixture
def hopper(lowered):
    return lowered("Hopper")


def assert_optimal(problem, inputs, plan):
    assert plan.status is pq.Status.CONVERGED, plan.message
    program = WholeHorizon(problem.build(), inputs.parameters, inputs.measured, plan.trajectory)
    assert program.kkt_residual().max <= 1e-5


@pytest.mark.parametrize(
    ("name", "value"), [("mass", 2.5), ("dt", 0.04), ("goal", [0.1, 0.0, 0.55])]
)
def test_parameters_change_between_solves(hopper, name, value):
    problem = LIBRARY["Hopper"]
    inputs = problem.inputs(hopper)
    solver = pq.Sqp(hopper, qp="ldl")
    before = solver.solve(*inputs)
    inputs.parameters[name] = value
    after = solver.solve(*inputs)
    assert abs(after.cost - before.cost) > 1e-3
    assert_optimal(problem, inputs, after)


def test_a_gait_that_moves_through_the_horizon(hopper):
    """Every phase of the gait, solved by one solver: roles and dimensions change each time."""
    problem = LIBRARY["Hopper"]
    inputs = problem.inputs(hopper)
    solver = pq.Sqp(hopper, qp="structured")
    rhythm = np.tile([1, 1, 1, 0, 0, 0], 6)
    for phase in range(6):
        stance = rhythm[phase + 1 :][: problem.N + 1]
        inputs.parameters["stance"] = stance
        inputs.parameters["stood"] = rhythm[phase:][: problem.N + 1]
        plan = solver.solve(*inputs)
        assert_optimal(problem, inputs, plan)
        swing = stance[: problem.N] == 0
        np.testing.assert_array_equal(plan.trajectory["force"][: problem.N][swing], 0)


@pytest.mark.parametrize("stance", [0, 1])
def test_no_contact_and_all_contact(hopper, stance):
    problem = LIBRARY["Hopper"]
    inputs = problem.inputs(hopper)
    inputs.parameters["stance"] = inputs.parameters["stood"] = stance
    plan = pq.Sqp(hopper, qp="structured").solve(*inputs)
    assert_optimal(problem, inputs, plan)


@pytest.mark.parametrize("policy", [pq.SquaredHinge(30.0), pq.Penalty(200.0, 0.01)])
def test_policies_change_between_solves(lowered, policy):
    problem = LIBRARY["BoundedIntegrator"]
    inputs = problem.inputs(lowered("BoundedIntegrator"))
    solver = pq.Sqp(lowered("BoundedIntegrator"), qp="ldl")
    before = solver.solve(*inputs)
    for family in ("upper", "lower"):
        solver.set_policy(family, policy)
    after = solver.solve(*inputs)
    assert after.cost != before.cost
    reference = pq.Ipopt(lowered("BoundedIntegrator"), penalize=True)
    for family in ("upper", "lower"):
        reference.set_policy(family, policy)
    assert after.cost == pytest.approx(reference.solve(*inputs).cost, rel=1e-7)


def test_any_horizon(lowered):
    problem, body = LIBRARY["RigidBody"], lowered("RigidBody")
    for horizon in (1, 4, 30):
        parameters, measured, guess = (
            body.parameters(horizon), body.knot(), body.trajectory(horizon)
        )  # fmt: skip
        problem.fill(parameters, measured, guess)
        plan = pq.Sqp(body, qp="structured", horizon=horizon).solve(parameters, measured, guess)
        assert plan.status is pq.Status.CONVERGED
        assert plan.xs.shape == (horizon + 1, 19)


def test_horizon_of_one_and_sixty_four_threads(lowered):
    inputs = LIBRARY["DoubleIntegrator"].inputs(lowered("DoubleIntegrator"))
    plan = pq.Sqp(lowered("DoubleIntegrator"), qp="ldl", threads=64).solve(*inputs)
    assert plan.status is pq.Status.CONVERGED


# ---- warm starts ---------------------------------------------------------------------------------


def test_sign_of_the_measured_quaternion_does_not_matter(lowered):
    body = lowered("RigidBody")
    inputs = LIBRARY["RigidBody"].inputs(body)
    solver = pq.Sqp(body, qp="ldl")
    plan = solver.solve(*inputs)
    inputs.measured["orientation"] *= -1
    flipped = solver.solve(*inputs)
    np.testing.assert_allclose(flipped.xs, plan.xs, atol=1e-12)
    # With a guess on the other side the plan stays there, with the same rotations.
    inputs.guess["orientation"] *= -1
    other = solver.solve(*inputs)
    a, b = plan.trajectory["orientation"], other.trajectory["orientation"]
    assert np.all(np.sum(a * b, axis=1) < 0)
    turns = (rotation(a).inv() * rotation(b)).magnitude()
    np.testing.assert_allclose(turns, 0, atol=1e-6)
    assert other.cost == pytest.approx(plan.cost, rel=1e-8)


def test_measured_quaternion_is_normalised(lowered):
    body = lowered("RigidBody")
    inputs = LIBRARY["RigidBody"].inputs(body)
    plan = pq.Sqp(body, qp="ldl").solve(*inputs)
    inputs.measured["orientation"] *= 1.7
    again = pq.Sqp(body, qp="ldl").solve(*inputs)
    np.testing.assert_allclose(again.xs, plan.xs, atol=1e-9)


@pytest.mark.parametrize("elapsed", [0.0, 0.02, 0.05, 0.13, 2.0])
def test_shifted_plan_follows_the_model(lowered, elapsed):
    """The optimal plan's states, seen later, lie between or behind the plan's own."""
    body = lowered("RigidBody")
    inputs = LIBRARY["RigidBody"].inputs(body)
    plan = pq.Sqp(body, qp="ldl").solve(*inputs)
    later = body.shift(plan.trajectory, inputs.parameters, elapsed)
    np.testing.assert_allclose(np.linalg.norm(later["orientation"], axis=1), 1, atol=1e-12)
    t = elapsed + 0.05 * np.arange(16)
    knots = np.minimum(t / 0.05, 15 - 1e-9)
    left, share = knots.astype(int), knots % 1
    inside = t <= 15 * 0.05 + 1e-9
    p = plan.trajectory["position"]
    between = p[left] + share[:, None] * (p[left + 1] - p[left])
    np.testing.assert_allclose(later["position"][inside], between[inside], atol=1e-9)
    # Beyond the end the last interval's rate goes on.
    beyond = p[-1] + (t[-1] - 0.75) / 0.05 * (p[-1] - p[-2])
    if elapsed > 0:
        np.testing.assert_allclose(later["position"][-1], beyond, atol=1e-9)


def test_shifted_plan_is_a_good_guess(lowered):
    """After one knot on the nominal model the shifted plan needs a fraction of the iterations."""
    body = lowered("RigidBody")
    inputs = LIBRARY["RigidBody"].inputs(body)
    solver = pq.Sqp(body, qp="ldl")
    plan = solver.solve(*inputs)
    measured = body.wrap(body.step(plan.xs[0], inputs.parameters.values[0]))
    np.testing.assert_allclose(measured["position"], plan.trajectory["position"][1], atol=1e-9)
    warm = body.shift(plan.trajectory, inputs.parameters, 0.05)
    warm_plan = solver.solve(inputs.parameters, measured, warm)
    cold_plan = solver.solve(inputs.parameters, measured)
    assert warm_plan.iteration_count < cold_plan.iteration_count
    assert warm_plan.cost == pytest.approx(cold_plan.cost, rel=1e-7)


@pytest.mark.parametrize("elapsed", [-0.1, np.nan, np.inf])
def test_shift_by_no_time_at_all(lowered, elapsed):
    body = lowered("RigidBody")
    with pytest.raises(ValueError, match="elapsed is"):
        body.shift(body.trajectory(), body.parameters(), elapsed)


@pytest.mark.parametrize(
    "duplicate", [lambda a: a.copy(), copy.deepcopy, lambda a: pickle.loads(pickle.dumps(a))]
)
def test_names_of_a_copy_are_views_of_the_copy(hopper, duplicate):
    original = hopper.parameters()
    original["goal"][:] = 1.0  # so that there is a view to copy
    other = duplicate(original)
    other["goal"] = 2.0
    columns = original.values != other.values
    assert columns.sum() == other["goal"].size
    np.testing.assert_array_equal(original["goal"], 1.0)
