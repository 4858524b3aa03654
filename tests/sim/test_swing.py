"""Swing paths: ends, apex, continuity, and which steps a rollout holds."""

import numpy as np
import pytest

from palanquin.sim.show.swing import Swing, foot_path, swings_of_foot

STEP = Swing(1.0, 1.4, np.array([0.1, 0.2, 0.0]), np.array([0.3, 0.25, 0.06]), 0.08)


def test_ends_are_the_footholds():
    np.testing.assert_allclose(STEP.position(np.array([1.0])), [STEP.lift_off], atol=1e-15)
    np.testing.assert_allclose(STEP.position(np.array([1.4])), [STEP.touchdown], atol=1e-15)


def test_apex_is_over_the_higher_foothold():
    path = STEP.position(np.linspace(1.0, 1.4, 401))
    assert path[:, 2].max() == pytest.approx(0.06 + 0.08, abs=1e-12)
    assert path[200, 2] == path[:, 2].max()
    np.testing.assert_allclose(path[200, :2], [0.2, 0.225], atol=1e-12)


def test_velocity_is_continuous_and_zero_at_the_ends():
    time = np.linspace(0.9, 1.5, 60001)
    velocity = np.gradient(STEP.position(time), time, axis=0)
    assert np.abs(np.diff(velocity, axis=0)).max() < 1e-3
    assert np.abs(velocity[(time <= 1.0) | (time >= 1.4)]).max() < 1e-3


def test_foot_stands_still_in_stance_and_lands_on_the_next_foothold(rollout):
    period = rollout.plan_time[1]
    at = np.linspace(rollout.time[0], rollout.time[-1], 2000)
    for robot in range(2):
        for foot in range(4):
            path = foot_path(rollout, robot, foot, at)
            assert np.abs(np.diff(path, axis=0)).max() < 0.01, "the path has no jump"
            for tick in np.flatnonzero(rollout.contact[:, robot, foot]):
                inside = (at >= rollout.time[tick]) & (at < rollout.time[tick] + period - 1e-9)
                foothold = rollout.feet[tick, robot, foot]
                np.testing.assert_allclose(path[inside], np.tile(foothold, (inside.sum(), 1)))


def test_cut_off_step_ends_where_the_plan_lands(make_rollout):
    rollout = make_rollout(ticks=4)
    step = swings_of_foot(rollout, robot=0, foot=1)[-1]
    assert step.end == pytest.approx(7 * rollout.plan_time[1])
    np.testing.assert_allclose(step.touchdown, rollout.plan_feet[-1, 4, 0, 1])
    assert rollout.plan_contact[-1, 3:5, 0, 1].tolist() == [0, 1]
