"""Rollouts: filling, saving, loading, and what is said about garbage."""

import dataclasses

import numpy as np
import pytest

from palanquin.events import Event, EventKind
from palanquin.sim.errors import InputError
from palanquin.sim.runs.record import Record, RecordBuilder, tick_shapes
from palanquin.sim.runs.teams import BarCarriers
from palanquin.sim.scenarios.team import Ditch

PHASES = ("linearise", "solve")
FAMILIES = ("friction", "reach")


def entry(robots=2, horizon=15):
    """A valid tick."""
    shapes = tick_shapes(robots + 1, robots, horizon)
    values = {name: np.zeros(shape) for name, shape in shapes.items()}
    values["x"].reshape(-1, 13)[:, 3] = 1
    values |= {"status": "converged", "phases": dict.fromkeys(PHASES, 0.1)}
    return values | {"violation": dict.fromkeys(FAMILIES, 0.0)}


def builder(rollout):
    """One that holds a tick."""
    build = RecordBuilder(rollout.team, rollout.plan_time)
    build.append(**entry())
    return build


def test_saved_and_loaded_are_equal(make_rollout, tmp_path):
    rollout = make_rollout(ticks=3, ditches=(Ditch(1, 0.2, -0.6, 0.25),))
    events = (Event(0.1, EventKind.KEPT_PLAN, "no step"), Event(0.2, EventKind.RESTART, "late"))
    rollout = dataclasses.replace(rollout, events=events)
    path = tmp_path / "run.npz"
    rollout.save(path)
    loaded = Record.load(path)
    assert loaded.team == rollout.team
    for field in dataclasses.fields(Record):
        before, after = getattr(rollout, field.name), getattr(loaded, field.name)
        if isinstance(before, dict):
            assert before.keys() == after.keys()
            for key in before:
                np.testing.assert_array_equal(before[key], after[key])
        elif field.name not in ("team", "fall"):
            np.testing.assert_array_equal(before, after)


def test_a_record_has_the_ticks_that_were_appended(rollout):
    build = builder(rollout)
    build.append(**entry() | {"time": 1.0, "usable": False})
    assert len(build) == 2
    record = build.build(0.5, fall="left fell")
    assert record.x.shape == (2, 39)
    assert record.bodies.shape == (2, 3, 13)
    assert record.usable.tolist() == [True, False]
    assert (record.duration, record.fall) == (1.0, "left fell")


def test_a_record_needs_a_tick(rollout):
    with pytest.raises(InputError, match="at least one tick"):
        RecordBuilder(rollout.team, rollout.plan_time).build(0.1)


def test_robots_on_bars_are_recorded_alike(tmp_path):
    team = BarCarriers(("left", "right"), "distributed", 0.6)
    build = RecordBuilder(team, [0.0, 0.1])
    shapes = tick_shapes(2, 2, 1)
    values = {name: np.zeros(shape) for name, shape in shapes.items()}
    values["x"].reshape(-1, 13)[:, 3] = 1
    build.append(**values, status="solved", more={"estimates": np.ones((2, 1))})
    record = build.build(0.1, extremes={"torque_fraction": 0.5})
    record.save(tmp_path / "run.npz")
    loaded = Record.load(tmp_path / "run.npz")
    assert loaded.team == team
    assert loaded.extremes == {"torque_fraction": 0.5}
    np.testing.assert_array_equal(loaded.more["estimates"], record.more["estimates"])


def built(build, change):
    """A record of one tick, changed."""
    build.append(**entry() | change)
    return build.build(0.1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"x": np.zeros(38)}, r"record\.x: shape \(38,\) instead of \(39,\)"),
        ({"feet": np.zeros((2, 3, 4))}, r"record\.feet: shape \(2, 3, 4\) instead of \(2, 4, 3\)"),
        ({"plan_x": np.full((16, 39), np.nan)}, r"record\.plan_x: every value must be finite"),
        ({"time": np.inf}, r"record\.time: every value must be finite"),
        ({"more": {"speed": 1.0}}, r"more: missing \[\], unknown \['speed'\]"),
        ({"speed": 1.0}, r"missing \[\], unknown \['speed'\]"),
        ({"phases": {"solve": 1.0}}, r"phases: missing \['linearise'\], unknown \[\]"),
        ({"violation": {}}, r"violation: missing \['friction', 'reach'\]"),
    ],
)
def test_bad_ticks_are_refused(rollout, change, message):
    with pytest.raises(InputError, match=message):
        built(builder(rollout), change)


def test_missing_array_is_named(rollout):
    values = entry()
    del values["force"]
    with pytest.raises(InputError, match=r"missing \['force'\]"):
        builder(rollout).append(**values)


def test_failed_solves_may_have_no_cost(rollout):
    build = builder(rollout)
    nothing = {"time": 1.0, "cost": np.nan, "force": np.full((2, 4, 3), np.nan)}
    build.append(**entry() | nothing)
    assert np.isnan(build.build(1.0).cost[1])


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
        Record(**{**vars(rollout), name: value(rollout)})


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
            Record.load(path)
    with pytest.raises(FileNotFoundError):
        Record.load(tmp_path / "absent.npz")
