"""Receding-horizon runs: the payload follows, standing feet stay, any rate and team size works."""

import numpy as np
import pytest

from palanquin.sim.errors import InputError
from palanquin.sim.runs.loop import number_of_ticks
from palanquin.sim.runs.nominal import feet_after
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import open_scenario, with_robots

TROT = open_scenario("trot")
USABLE = {"converged", "iteration_limit"}


def scenario_of(robots=2, gait="trot", velocity=(0.4, 0.0, 0.0), rate=30.0, **changes):
    scenario = with_robots(TROT, robots)
    vx, vy, wz = velocity
    return scenario.changed(
        robots=[{**dict(robot), "gait": gait} for robot in scenario.robots],
        command={"type": "velocity", "steps": [{"vx": vx, "vy": vy, "wz": wz}]},
        planner={"rate": rate},
        **{"duration": 1.0, **changes},
    )


def run(**changes):
    return run_scenario(scenario_of(**changes))


def stays(rollout):
    """How far each foot moves between two ticks at both of which it stands, m."""
    standing = (rollout.contact[1:] > 0.5) & (rollout.contact[:-1] > 0.5)
    moved = np.linalg.norm(np.diff(rollout.feet, axis=0), axis=-1)
    return moved[standing]


@pytest.mark.parametrize(
    ("rate", "changes"),
    [
        (30.0, {}),
        (30.0, {"robots": 1}),
        (30.0, {"robots": 3}),
        (50.0, {}),
        (47.0, {"gait": "pace"}),
        (20.0, {}),
        (30.0, {"gait": "pronk"}),
        (30.0, {"gait": "crawl"}),
        (30.0, {"velocity": (0.2, 0.1, 0.2)}),
        (30.0, {"seed": 5}),
    ],
)
def test_payload_follows_and_standing_feet_stay(rate, changes):
    rollout = run(rate=rate, **changes)
    assert len(rollout.time) == round(rate)
    assert set(rollout.status) <= USABLE
    result = outcome(rollout)
    assert result["completed"]
    assert result["payload_position_error_m"]["max"] < 0.02
    assert stays(rollout).max() < 1e-12
    lowest = np.where(rollout.contact > 0.5, rollout.feet[..., 2], 0.0)
    np.testing.assert_allclose(lowest, 0.0, atol=1e-12)


def test_feet_step_forward_as_fast_as_the_payload():
    rollout = run(duration=2.0)
    stride = rollout.feet[-1, ..., 0] - rollout.feet[0, ..., 0]
    np.testing.assert_allclose(stride, 0.4 * rollout.time[-1], atol=0.15)


def test_the_first_plan_has_converged_before_the_clock_starts():
    rollout = run(duration=0.2)
    assert rollout.status[0] == "converged"
    assert rollout.equality_violation[0] < 1e-8


def test_the_model_moves_as_its_plan_says():
    # At the knots' own rate the nominal model is the plan's: state 1 of a plan, once its dynamics
    # rows hold, is the next measurement.
    rollout = run(duration=0.5)
    residual = rollout.equality_violation[:-1].max()
    step = np.abs(rollout.x[1:] - rollout.plan_x[:-1, 1]).max()
    assert step < 2 * residual + 1e-9


def test_a_foot_that_lands_between_ticks_stands_on_the_planned_foothold():
    planner = TROT.build_planner()
    state = planner.nominal_state()
    plan = planner.settle(0.0, state, TROT.command.at(0.0))
    touchdown = 7 / 30
    landed = planner.contacts(np.array([touchdown]))[0] & ~plan.contacts[0]
    assert landed.any()
    feet = feet_after(planner, plan, state.feet, touchdown + 0.01)
    np.testing.assert_array_equal(feet[landed], plan.feet[7][landed])
    np.testing.assert_array_equal(feet[~landed], state.feet[~landed])
    # At the very touchdown the next plan may still choose.
    free = feet_after(planner, plan, state.feet, touchdown)
    np.testing.assert_array_equal(free, state.feet)


def test_a_run_that_diverges_ends_early():
    rollout = run(robots=1, velocity=(-40.0, 0.0, 0.0), duration=3.0)
    assert len(rollout.time) < 90
    assert not outcome(rollout)["completed"]


def test_progress_counts_ticks():
    ticks = []
    run_scenario(scenario_of(duration=0.1), progress=ticks.append)
    assert ticks == [1, 2, 3]


@pytest.mark.parametrize(
    ("duration", "period", "message"),
    [
        (0.0, 0.1, "duration: 0.0 s must be positive"),
        (1.0, float("nan"), "period: nan s must be positive"),
        (0.01, 0.1, "has 0 periods of 0.1 s"),
        (1e7, 0.1, "from 1 to 50000"),
    ],
)
def test_bad_durations_are_refused(duration, period, message):
    with pytest.raises(InputError, match=message):
        number_of_ticks(duration, period)
