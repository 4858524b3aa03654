"""The engine on the reference cases, against optima that another implementation found."""

import json
from pathlib import Path

import numpy as np
import pytest

from palanquin.plan import Status
from palanquin.problems import clm
from palanquin.problems.clm.references import STATE
from palanquin.problems.clm.solve import solve_case

CASES = Path(__file__).parents[1] / "data" / "cases"
EXPECTED = json.loads((CASES / "expected.json").read_text())
NAMES = ["stand", "trot", "ditch", "ramp"]


def load(name):
    return clm.load_case(CASES / f"{name}.json")


@pytest.mark.parametrize("name", NAMES)
def test_ipopt_finds_the_hard_optimum_or_a_better_one(name):
    result = solve_case(load(name), "ipopt", max_starts=4)
    assert result.solved
    assert result.plan.cost <= EXPECTED[name]["hard"]["total_cost"] * (1 + 1e-5)
    assert max(result.plan.violation.values()) < 1e-5
    assert result.plan.equality_violation < 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_ipopt_with_penalties_finds_their_optimum(name):
    result = solve_case(load(name), "ipopt", penalty=True, max_starts=1)
    assert result.plan.cost == pytest.approx(EXPECTED[name]["penalty"]["total_cost"], rel=1e-6)


@pytest.mark.parametrize("qp", ["structured", "ldl", "osqp"])
@pytest.mark.parametrize("name", NAMES)
def test_sqp_finds_the_penalty_optimum(name, qp):
    result = solve_case(load(name), "sqp", qp=qp)
    assert result.plan.status == Status.CONVERGED
    assert result.plan.cost == pytest.approx(EXPECTED[name]["penalty"]["total_cost"], rel=1e-4)
    assert result.plan.equality_violation < 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_result_is_a_trajectory_of_the_model(name):
    """X and U in the file's layout obey (2) to (4) and start where the case says."""
    case = load(name)
    result = solve_case(case, "sqp", qp="ldl", max_starts=1)
    xs, us = result.xs, result.us
    np.testing.assert_allclose(xs[0], case.x0, atol=1e-12)
    bodies = xs.reshape(len(xs), -1, STATE)
    hand_forces = us.reshape(len(us), -1, 30)[:, :, 24:27]
    ground_forces = us.reshape(len(us), -1, 10, 3)[:, :, 0:8:2].sum(axis=2)
    mass = np.array([case.payload.m, *(robot.m for robot in case.robots)])
    force = np.concatenate([-hand_forces.sum(1, keepdims=True), hand_forces + ground_forces], 1)
    acceleration = force / mass[:, None] + [0, 0, -9.81]
    np.testing.assert_allclose(
        np.diff(bodies[..., 7:10], axis=0), case.dt * acceleration, atol=1e-7
    )
    np.testing.assert_allclose(
        np.diff(bodies[..., :3], axis=0), case.dt * bodies[1:, :, 7:10], atol=1e-7
    )
    np.testing.assert_allclose(np.linalg.norm(bodies[..., 3:7], axis=-1), 1, atol=1e-12)


def test_sign_of_the_measured_quaternion_does_not_matter():
    case = load("stand")
    flipped = np.array(case.x0)
    flipped[3:7] *= -1
    other = solve_case(case.model_copy(update={"x0": flipped}), "sqp", qp="ldl")
    assert other.plan.status == Status.CONVERGED
    assert other.plan.cost == pytest.approx(EXPECTED["stand"]["penalty"]["total_cost"], rel=1e-6)
    np.testing.assert_allclose(other.xs[0], flipped, atol=1e-12)


def test_one_real_time_iteration_gives_a_usable_plan():
    result = solve_case(load("trot"), "rti", qp="ldl")
    assert result.solved
    assert result.plan.iteration_count == 1
