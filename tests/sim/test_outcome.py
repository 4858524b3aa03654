"""Figures of a run, on a made-up rollout."""

from dataclasses import replace

import numpy as np
import pytest

from palanquin.events import Event, EventKind
from palanquin.plan import SQP_PHASES
from palanquin.problems import quaternions
from palanquin.sim.runs.run_outcome import outcome


@pytest.fixture(scope="module")
def long(make_rollout):
    """Two seconds whose violations are called as those of the CLM problem."""
    rollout = make_rollout(ticks=60)
    ones = np.ones(60)
    phases = {"inputs": ones, **dict.fromkeys(SQP_PHASES, ones)}
    return replace(
        rollout,
        violation={"leg": 2e-3 * ones, "friction": 30.0 * ones},
        phases=phases,
        solve_ms=np.where(np.arange(60) == 7, 40.0, 5.0),
    )


def changed_state(rollout, tick, body, columns, values):
    x = rollout.x.copy()
    x.reshape(len(x), -1, 13)[tick, body, columns] = values
    return replace(rollout, x=x)


def test_figures(long):
    figures = outcome(long)
    assert figures["completed"] is True
    assert figures["fell"] is False
    assert figures["duration_s"] == pytest.approx(2.0)
    assert figures["distance_m"] == pytest.approx(0.4 * 59 / 30, rel=0.2)
    assert figures["violation"] == {"leg": 2e-3, "friction": 0.3}  # m and 100 N
    assert figures["solver_ms"] == dict.fromkeys(
        ("p50", "p95", "p99", "max"), float(len(SQP_PHASES))
    )
    assert figures["solve_ms"]["max"] == 40.0
    assert figures["deadline_misses"] == 1
    assert figures["fallbacks"] == 0


def test_payload_errors_count_after_the_first_second(long):
    early = changed_state(long, 10, 0, 0, 5.0)
    late = changed_state(long, 40, 0, slice(0, 3), long.reference[40, :3] + [0.03, 0.0, 0.04])
    before = outcome(long)["payload_position_error_m"]
    assert outcome(early)["payload_position_error_m"] == before
    after = outcome(late)["payload_position_error_m"]
    assert after["max"] == pytest.approx(0.05)
    assert before["rms"] < after["rms"] < after["max"]


def test_a_run_cut_short_is_not_completed(long):
    figures = outcome(replace(long, fall="the plan diverged"))
    assert figures["completed"] is False
    assert figures["fell"] is False


@pytest.mark.parametrize("body", [0, 1, 2])
def test_a_body_that_leans_has_fallen(long, body):
    for degrees, has_fallen in ((28.0, False), (32.0, True)):
        lean = quaternions.from_rotation_vector(np.radians([degrees, 0.0, 0.0]))
        figures = outcome(changed_state(long, 20, body, slice(3, 7), lean))
        assert figures["fell"] is has_fallen
        assert figures["completed"] is not has_fallen


def test_turning_about_the_vertical_is_no_fall(long):
    turned = changed_state(long, 20, 1, slice(3, 7), quaternions.from_yaw(1.5))
    assert outcome(turned)["fell"] is False


def test_a_robot_that_sinks_has_fallen(long):
    assert outcome(changed_state(long, 20, 2, 2, 0.1))["fell"] is True


def test_unusable_plans_count_as_fallbacks(long):
    usable = np.arange(60) >= 3
    assert outcome(replace(long, usable=usable))["fallbacks"] == 3


def test_events_are_counted_by_kind(long):
    events = (Event(0.1, EventKind.DAMPED_STEP, "length 0.5"), Event(0.2, EventKind.RESTART, ""))
    counts = outcome(replace(long, events=events))["events"]
    assert counts["damped_step"] == counts["restart"] == 1
    assert sum(counts.values()) == 2
