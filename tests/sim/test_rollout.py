"""Rollouts: filling, saving, loading, and what is said about garbage."""

import dataclasses

import numpy as np
import pytest

from palanquin.events import Event, EventKind
from palanquin.sim.errors import InputError
from palanquin.sim.rollout import Rollout, RolloutBuilder, tick_shapes
from palanquin.sim.team import Ditch

PHASES = ("linearise", "solve")
FAMILIES = ("friction", "reach")


def entry(robots=2, horizon=15):
    """A valid tick."""
    values = {name: np.zeros(shape) for name, shape in tick_shapes(robots, horizon).items()}
    values["x"].reshape(-1, 13)[:, 3] = 1
    values |= {"status": "converged", "phases": dict.fromkeys(PHASES, 0.1)}
    return values | {"violation": dict.fromkeys(FAMILIES, 0.0)}


def builder(rollout, capacity=3):
    return RolloutBuilder(rollout.team, rollout.plan_time, capacity, PHASES, FAMILIES)


def test_saved_and_loaded_are_equal(make_rollout, tmp_path):
    rollout = make_rollout(ticks=3, ditches=(Ditch(1, 0.2, -0.6, 0.25),))
    events = (Event(0.1, EventKind.KEPT_PLAN, "no step"), Event(0.2, EventKind.RESTART, "late"))
    rollout = dataclasses.replace(rollout, events=events)
    path = tmp_path / "run.npz"
    rollout.save(path)
    loaded = Rollout.load(path)
    assert loaded.team == rollout.team
    for field in dataclasses.fields(Rollout):
        before, after = getattr(rollout, field.name), getattr(loaded, field.name)
        if isinstance(before, dict):
            assert before.keys() == after.keys()
            for key in before:
                np.testing.assert_array_equal(before[key], after[key])
        elif field.name != "team":
            np.testing.assert_array_equal(before, after)


def test_capacity_is_a_bound_and_unused_ticks_are_dropped(rollout):
    build = builder(rollout)
    for tick in range(2):
        build.append(**entry() | {"time": float(tick)})
    assert len(build) == 2
    assert build.build().x.shape == (2, 39)
    build.append(**entry() | {"time": 2.0})
    with pytest.raises(InputError, match="full after 3 ticks"):
        build.append(**entry() | {"time": 3.0})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"x": np.zeros(38)}, r"rollout\.x: shape \(38,\) instead of \(39,\)"),
        ({"feet": np.zeros((2, 3, 4))}, r"rollout\.feet: shape \(2, 3, 4\) instead of \(2, 4, 3\)"),
        ({"plan_x": np.full((16, 39), np.nan)}, r"rollout\.plan_x: every value must be finite"),
        ({"time": np.inf}, r"rollout\.time: every value must be finite"),
        ({"speed": 1.0}, r"missing \[\], unknown \['speed'\]"),
        ({"phases": {"solve": 1.0}}, r"phases: missing \['linearise'\], unknown \[\]"),
        ({"violation": {}}, r"violation: missing \['friction', 'reach'\]"),
    ],
)
def test_bad_ticks_are_refused(rollout, change, message):
    with pytest.raises(InputError, match=message):
        builder(rollout).append(**entry() | change)


def test_missing_array_is_named(rollout):
    values = entry()
    del values["force"]
    with pytest.raises(InputError, match=r"missing \['force'\]"):
        builder(rollout).append(**values)


def test_failed_solves_may_have_no_cost(rollout):
    build = builder(rollout)
    build.append(**entry() | {"cost": np.nan, "force": np.full((2, 4, 3), np.nan)})
    assert np.isnan(build.build().cost[0])


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("time", lambda r: r.time[::-1], "must increase"),
        ("x", lambda r: 2 * r.x, "no unit quaternion"),
        ("x", lambda r: r.x[:-1], r"shape \(39, 39\) instead of \(40, 39\)"),
        ("status", lambda r: r.status[1:], "status"),
        ("plan_time", lambda r: r.plan_time + 1, "must start at 0"),
        ("plan_time", lambda r: r.plan_time[:1], "N >= 1"),
        ("violation", lambda r: {"friction": np.zeros(3)}, r"violation\['friction'\]"),
        ("time", lambda r: np.zeros(0), "at least one tick"),
    ],
)
def test_inconsistent_rollouts_are_refused(rollout, name, value, message):
    with pytest.raises(InputError, match=message):
        Rollout(**{**vars(rollout), name: value(rollout)})


def test_files_that_are_no_rollouts(tmp_path, rollout):
    text = tmp_path / "text.npz"
    text.write_text("not an archive")
    other = tmp_path / "other.npz"
    np.savez(other, a=np.zeros(2))
    cut, whole = tmp_path / "cut.npz", tmp_path / "whole.npz"
    rollout.save(whole)
    cut.write_bytes(whole.read_bytes()[:5000])
    with np.load(whole) as file:
        arrays = dict(file)
    missing = tmp_path / "missing.npz"
    np.savez(missing, **{k: v for k, v in arrays.items() if k != "force"})
    strange = tmp_path / "strange.npz"
    np.savez(strange, **arrays | {"team": np.array("[1, 2")})
    group = tmp_path / "group.npz"
    np.savez(group, **arrays | {"colour/red": np.zeros(40)})
    for path in (text, other, cut, missing, strange, group):
        with pytest.raises(InputError):
            Rollout.load(path)
    with pytest.raises(FileNotFoundError):
        Rollout.load(tmp_path / "absent.npz")
