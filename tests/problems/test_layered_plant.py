"""The reduced-order plant against invariants, and walks on it."""

from dataclasses import replace

import numpy as np
import pytest

from palanquin.problems.layered import Bar, Team, rotations
from palanquin.problems.layered.plant import Payload, Plant
from palanquin.problems.planning import Velocity
from palanquin.sim.runs.reduced import standing
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import BarScenario
from palanquin.sim.scenarios.bar_forces import Force
from palanquin.sim.scenarios.bar_team import BarTeam

BARS = {
    "free": Bar(),
    "yaw held": Bar(restrict=("yaw",)),
    "all held": Bar(restrict=("roll", "pitch", "yaw")),
    "off centre": Bar(attach=((0.05, 0.02, 0.1), (-0.03, 0.0, 0.2)), length=0.97),
}


def tumbling(team, plant):
    """A state on the bars whose velocities keep their rows, feet off the ground."""
    rng = np.random.default_rng(1)
    state = standing(team)
    bar = team.bars[0]
    first = state.position[0] + np.asarray(bar.attach[0])
    position = state.position.copy()
    position[1] = first + np.array([0.0, -bar.length, 0.0]) - np.asarray(bar.attach[1])
    v = rng.normal(size=(2, 6)).ravel()
    state = replace(state, position=position)
    J = plant._evaluate(state, np.zeros((2, 4, 3)), None)[2]
    v = (v - np.linalg.pinv(J) @ (J @ v)).reshape(2, 6)
    return replace(state, velocity=v[:, :3], angular_velocity=v[:, 3:])


def joint_angles(bar, state):
    """Largest sine by which the joints of a bar along -y have turned: about x and z at both ends,
    and about y of one robot against the other.
    """
    arms = np.einsum("iab,ib->ia", state.rotation, np.asarray(bar.attach))
    ends = state.position + arms
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    seen = [R.T @ along for R in state.rotation]
    twist = state.rotation[0].T @ state.rotation[1]
    return {
        "roll": max(abs(d[2]) for d in seen),
        "pitch": abs(twist[0, 2] - twist[2, 0]) / 2,
        "yaw": max(abs(d[0]) for d in seen),
    }


@pytest.mark.parametrize("payload", [0.0, 5.0])
@pytest.mark.parametrize("name", BARS)
def test_flight_keeps_energy_and_the_bar(name, payload):
    team = Team(bars=(BARS[name],))
    plant = Plant(team, (Payload(payload, 0.3),), step=1e-3)
    state = tumbling(team, plant)
    before = plant.energy(state)
    still = np.zeros((2, 4, 3)), np.zeros((2, 3))
    after = plant.advance(state, *still, 0.5)
    assert np.abs(after.rotation - state.rotation).max() > 0.1  # or little would have been kept
    assert plant.energy(after) == pytest.approx(before, abs=1e-6)
    assert plant.constraint_error(after) < 1e-8
    for axis, angle in joint_angles(team.bars[0], after).items():
        assert angle < 1e-7 if axis in BARS[name].restrict else angle > 0.02, axis


def test_free_fall_of_the_common_centre():
    team = Team()
    plant = Plant(team, step=1e-3)
    state = tumbling(team, plant)
    after = plant.advance(state, np.zeros((2, 4, 3)), np.zeros((2, 3)), 0.3)
    expected = state.position + 0.3 * state.velocity
    expected[:, 2] -= 0.5 * 9.81 * 0.3**2
    np.testing.assert_allclose(after.position.mean(0), expected.mean(0), atol=1e-9)


def test_rotation_helpers_invert_each_other():
    vectors = np.random.default_rng(0).normal(size=(50, 3))
    vectors[0] = 0.0
    np.testing.assert_allclose(rotations.log(rotations.exp(vectors)), vectors, atol=1e-12)


WALK = BarScenario(tracking="reduced", velocity=Velocity(0.3), ramp=0.0, duration=2.0)


@pytest.mark.parametrize("planner", ["centralized", "distributed"])
def test_a_pair_walks_with_an_unknown_payload(planner):
    log = run_scenario(WALK.changed(planner=planner, team=BarTeam(payload=5.0)))
    assert not log.fall
    assert not log.events
    assert log.extremes["bar_length_error_m"] < 1e-6
    assert log.bodies[-40:, :, 7].mean() == pytest.approx(0.3, abs=0.06)


def test_three_robots_walk_on_two_bars():
    log = run_scenario(WALK.changed(team=BarTeam(3), duration=1.0))
    assert not log.fall
    assert not log.events
    assert log.extremes["bar_length_error_m"] < 1e-6


def test_a_fall_ends_the_walk():
    pushes = tuple(Force.constant(robot, (0.0, 400.0, 0.0), 0.1) for robot in (0, 1))
    log = run_scenario(WALK.changed(forces=pushes, duration=5.0))
    assert "fell" in log.fall
    assert log.duration < 5.0
