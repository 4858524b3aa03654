"""Campaigns in hands: what seeds and values draw, what is counted, runs in processes."""

import dataclasses

import numpy as np
import pytest

from palanquin.sim.errors import InputError
from palanquin.sim.feasibility import findings
from palanquin.sim.runs import hands_campaign
from palanquin.sim.runs.campaign import missing_of, run_trials
from palanquin.sim.runs.hands_campaign import SUITES, HandsTrial, hands_summary, hands_trials
from palanquin.sim.runs.store import RowStore


def trial(suite, value=164.0, without=(), period=0.0, seed=1):
    return HandsTrial(suite, value, without, period, seed)


VALUES = {"payload": 20.0, "robots": 1.1}


@pytest.mark.parametrize("suite", SUITES)
def test_suites_repeat_vary_with_their_seed_and_can_be_run(suite):
    first, again, other = (
        trial(suite, VALUES.get(suite, 164.0), seed=seed).scenario() for seed in (1, 1, 2)
    )
    assert first == again
    assert first != other
    assert first.tracking == "physics"
    assert [f for f in findings(first) if f.is_error] == []


def test_pushes_are_drawn_all_around():
    pushes = [trial("push-trot", 100.0, seed=seed).scenario().pushes[0] for seed in range(40)]
    angles = [np.arctan2(*push.force[1::-1]) for push in pushes]
    assert min(angles) < -2 < 2 < max(angles)
    assert {push.body for push in pushes} == {"left", "right"}
    np.testing.assert_allclose([np.hypot(*push.force[:2]) for push in pushes], 100.0)
    starts = [push.start for push in pushes]
    assert 0.4 < max(starts) - min(starts) < 0.5


def test_what_a_trial_is_told_reaches_its_scenario():
    scenario = trial("push-three", without=("arm_torque", "observers"), period=0.3).scenario()
    assert len(scenario.robots) == 3
    assert {robot.gait.period for robot in scenario.robots} == {0.3}
    assert (scenario.planner.arm_torque, scenario.planner.observers) == (None, None)
    assert scenario.planner.leg_torque.share == 1.0
    assert trial("payload", 20.0).scenario().world.payload_mass == 20.0
    assert trial("robots", 0.9).scenario().world.robot_mass == 0.9
    assert trial("push-stand").scenario().robots[0].gait.name == "stand"
    assert trial("push-slope").scenario().ground.height(1.0, 0.0) == pytest.approx(0.404, abs=1e-3)


def row(seed, completed, angle, away, **fields):
    return {
        "suite": "push-trot", "value": 164.0, "without": [], "period": 0.0, "seed": seed,
        "completed": completed, "fall": "" if completed else "left fell", "angle_deg": angle,
        "payload_max_m": away, "payload_end_m": away / 10, "height_max_m": away / 2,
        "saturated_share": 0.01, **fields,
    }  # fmt: skip


def test_backward_pushes_are_counted_apart():
    rows = [row(1, True, 90.0, 0.02), row(2, True, -150.0, 0.1), row(3, False, 180.0, 0.5)]
    counted, bare = hands_summary([*rows, row(1, False, 0.0, 1.0, without=["observers"])])
    assert (counted["completed"], counted["trials"], counted["backwards"]) == (2, 3, "1 of 2")
    assert (counted["payload_max_m"], counted["payload_max_backwards_m"]) == (0.02, 0.1)
    assert counted["falls"] == ["left fell"]
    assert (bare["without"], bare["completed"]) == ("observers", 0)
    assert np.isnan(bare["payload_max_m"])


def test_trials_run_and_are_kept(tmp_path, monkeypatch):
    short = dataclasses.replace(
        SUITES["payload"], draw=lambda scenario, mass, seed: scenario.changed(duration=0.2)
    )
    monkeypatch.setitem(hands_campaign.SUITES, "payload", short)
    results = RowStore(tmp_path / "results.jsonl", {}, resume=True)
    wanted = hands_trials("payload", (16.0,), (), 0.0, 1)
    (only,) = run_trials(wanted, results, jobs=1)
    assert only["completed"]
    assert only["payload_max_m"] < 0.05  # the start is a little off
    assert only["mass_kg"] == pytest.approx(16.0, abs=0.5)
    assert missing_of(wanted, RowStore(tmp_path / "results.jsonl", {}, resume=True)) == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("moon", (1.0,), (), 0.0, 1), "suite: 'moon' is not one of push-stand"),
        (("payload", (1.0,), ("luck",), 0.0, 1), "without: 'luck' is not one of leg_torque"),
        (("payload", (-1.0,), (), 0.0, 1), "must be positive"),
        (("payload", (1.0,), (), -1.0, 1), "period -1.0 not negative"),
        (("payload", (1.0,), (), 0.0, 0), "seeds: 0"),
    ],
)
def test_garbage_is_explained(arguments, message):
    with pytest.raises(InputError, match=message):
        hands_trials(*arguments)
