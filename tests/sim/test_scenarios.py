"""Scenarios: teams that fit their scene, starts that repeat, values that are checked."""

from dataclasses import replace

import numpy as np
import pytest

from palanquin.errors import ProblemError
from palanquin.problems import terrains
from palanquin.problems.clm.planner import TeamState
from palanquin.problems.clm.references import nominal_state
from palanquin.problems.gaits import trot
from palanquin.sim.errors import InputError
from palanquin.sim.scenarios import SCENARIOS, by_name, disturbed, lineup

RAMP = terrains.Ramp(height=1.6, slope=0.8, x=0.5)


@pytest.fixture
def nominal():
    team = lineup.planning_team(2, trot())
    return TeamState(*nominal_state(team, RAMP, np.zeros(3)))


@pytest.mark.parametrize("robots", [1, 2, 3, 4])
def test_planner_and_scene_agree_on_the_team(robots):
    planned, drawn = lineup.planning_team(robots, trot()), lineup.scene_team(robots)
    assert planned.robots == [robot.name for robot in drawn.robots]
    assert [c.attach for c in planned.carriers] == [robot.attach for robot in drawn.robots]
    assert planned.payload.mass == drawn.payload.mass
    assert all(abs(robot.attach[1]) < drawn.payload.size[1] / 2 for robot in drawn.robots)
    np.testing.assert_allclose(planned.attach().mean(axis=0), 0.0, atol=1e-15)


def test_seed_zero_is_nominal(nominal):
    assert disturbed(nominal, RAMP, 0) is nominal


def test_a_seed_gives_the_same_start_again(nominal):
    first, again, other = (disturbed(nominal, RAMP, seed) for seed in (7, 7, 8))
    np.testing.assert_array_equal(first.bodies, again.bodies)
    np.testing.assert_array_equal(first.feet, again.feet)
    assert np.abs(first.bodies - other.bodies).max() > 1e-3


def test_disturbed_starts_are_near_and_on_the_ground(nominal):
    before = nominal.bodies.copy()
    state = disturbed(nominal, RAMP, 1)
    moved = state.bodies - before
    np.testing.assert_array_equal(nominal.bodies, before)
    assert 0 < np.abs(moved[:, :3]).max() <= 0.02
    assert 0 < np.abs(moved[:, 7:10]).max() <= 0.05
    np.testing.assert_allclose(np.linalg.norm(state.bodies[:, 3:7], axis=1), 1.0)
    ground = RAMP.height(state.feet[..., 0], state.feet[..., 1])
    np.testing.assert_allclose(state.feet[..., 2], ground)


@pytest.mark.parametrize("name", SCENARIOS)
def test_scenarios_know_their_names(name):
    assert by_name(name).name == name
    assert "kinematic" in by_name(name).trackings


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"robots": 0}, InputError, "robots: 0 must be from 1 to 4"),
        ({"gait": "hop"}, ProblemError, "gait 'hop' is unknown"),
        ({"gait": "stand"}, InputError, "must be 0 with the gait 'stand'"),
        ({"horizon": 201}, InputError, "horizon: 201 must be from 1 to 200"),
        ({"duration": -1.0}, ProblemError, "duration is -1.0; it must be positive"),
        ({"dt": 0.0}, ProblemError, "dt is 0.0; it must be positive"),
    ],
)
def test_bad_scenarios_are_refused(changes, error, message):
    with pytest.raises(error, match=message):
        replace(by_name("trot"), **changes)


def test_negative_seeds_are_refused(nominal):
    with pytest.raises(InputError, match="seed: -1 must be at least 0"):
        disturbed(nominal, RAMP, -1)


def test_tracking_that_is_not_there_is_refused():
    with pytest.raises(InputError, match="'physics' is not available for this scenario yet"):
        by_name("trot").check_tracking("physics")
