"""Look-ahead footholds: where they are for a known motion."""

import numpy as np
import pytest

from palanquin.errors import ProblemError
from palanquin.problems import clm, gaits, terrains
from palanquin.problems.clm.footholds import MOST_CORRECTION, raibert_footholds
from palanquin.problems.clm.references import make_references

TIMES = np.arange(16) / 30
SPEED = 0.4


def footholds(team, terrain, too_fast=(0.0, 0.0), wz=0.0):
    start = np.zeros(3)
    command = clm.Velocity(SPEED, 0.0, wz)
    robots = make_references(team, terrain, start, command, 15, 1 / 30).bodies[:, 1:]
    clock = gaits.GaitClock(gaits.trot(period=14 / 30))
    begin, end = (np.repeat(part[:, None], 2, axis=1) for part in clock.stances(TIMES))
    relative = raibert_footholds(
        team, robots, terrain, TIMES, (begin, end), np.tile(too_fast, (2, 1))
    )
    return robots[..., None, :3] + relative, begin, end, robots


def test_a_foot_lands_half_a_stance_ahead_of_its_hip(team):
    feet, begin, end, robots = footholds(team, terrains.Flat())
    hips = robots[0, 0, :3] + team.hips()[0]
    middle = (begin[:, 0] + end[:, 0]) / 2
    np.testing.assert_allclose(feet[:, 0, :, 0], hips[:, 0] + SPEED * middle, atol=1e-12)
    np.testing.assert_allclose(feet[:, 0, :, 1], np.tile(hips[:, 1], (16, 1)), atol=1e-12)
    # One foothold a stance, a step of speed times period apart.
    steps = np.unique(feet[:, 0, 0, 0].round(9))
    np.testing.assert_allclose(np.diff(steps), SPEED * 14 / 30, atol=1e-9)


def test_feet_are_on_the_slope(team):
    ramp = terrains.Ramp(height=1.6, slope=0.6, x=0.3)
    feet, *_ = footholds(team, ramp)
    np.testing.assert_allclose(feet[..., 2], ramp.height(feet[..., 0], feet[..., 1]))


def test_only_steps_to_come_answer_to_excess_velocity(team):
    calm, begin, *_ = footholds(team, terrains.Flat())
    pushed, *_ = footholds(team, terrains.Flat(), too_fast=(0.2, -9.0))
    moved = pushed - calm
    height = np.array([carrier.model.standing_height for carrier in team.carriers])
    expected = np.broadcast_to(0.2 * np.sqrt(height / 9.81)[:, None], begin.shape)
    later = begin > 0
    np.testing.assert_allclose(moved[later][:, 0], expected[later], rtol=1e-9)
    np.testing.assert_allclose(moved[later][:, 1], -MOST_CORRECTION)
    np.testing.assert_array_equal(moved[~later], 0.0)
    assert later.any()
    assert not later.all()


@pytest.mark.parametrize("gait", [gaits.trot(), gaits.crawl(), gaits.pronk(), gaits.stand()])
def test_stances_agree_with_contacts(gait):
    clock = gaits.GaitClock(gait, time=0.1, phase=0.3)
    times = np.linspace(0, 3, 500)
    begin, end = clock.stances(times)
    inside = (begin <= times[:, None] + 1e-5) & (times[:, None] < end - 1e-5)
    np.testing.assert_array_equal(inside, clock.contacts(times))
    assert (end > times[:, None] - 1e-5).all()


def test_unknown_rule_names_the_known_ones(problem):
    with pytest.raises(ProblemError, match=r"footholds is 'best'.*hips, raibert"):
        clm.Planner(problem, footholds="best")
