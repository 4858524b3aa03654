"""Contact patterns, their clock, and what they refuse."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palanquin.errors import ProblemError
from palanquin.problems import gaits
from palanquin.problems.gaits import Gait, GaitClock

DT = 1 / 30


def pattern(gait, n):
    return GaitClock(gait).contacts(np.arange(n) * DT).astype(int).tolist()


def test_trot_alternates_diagonals_for_seven_knots_each():
    assert pattern(gaits.trot(period=14 / 30), 28) == 2 * (7 * [[1, 0, 0, 1]] + 7 * [[0, 1, 1, 0]])


@pytest.mark.parametrize(
    ("gait", "together"),
    [
        (gaits.trot(), [("LF", "RH"), ("RF", "LH")]),
        (gaits.pace(), [("LF", "LH"), ("RF", "RH")]),
        (gaits.bound(), [("LF", "RF"), ("LH", "RH")]),
        (gaits.pronk(), [("LF", "RF", "LH", "RH")]),
    ],
)
def test_feet_that_move_together(gait, together):
    flags = gait.stands(np.linspace(0, 1, 200, endpoint=False))
    feet = ["LF", "RF", "LH", "RH"]
    columns = {name: flags[:, i].tolist() for i, name in enumerate(feet)}
    for group in together:
        for name in feet:
            assert (columns[name] == columns[group[0]]) == (name in group)


def test_crawl_swings_one_foot_at_a_time_in_lateral_sequence():
    flags = gaits.crawl().stands(np.linspace(0, 1, 400, endpoint=False))
    assert set(flags.sum(axis=1).tolist()) == {3}
    swinging = np.argmin(flags, axis=1)
    order = [int(swinging[0])]
    order += [int(f) for before, f in pairwise(swinging) if f != before]
    start = order.index(2)
    assert (order + order)[start : start + 4] == [2, 0, 3, 1]  # LH, LF, RH, RF


def test_stand_always_stands():
    assert gaits.stand().stands(np.linspace(-3, 3, 101)).all()


@given(
    duty=st.floats(0.05, 1.0),
    period=st.floats(0.1, 3.0),
    offset=st.floats(-2.0, 2.0),
)
def test_duty_is_the_fraction_of_time_in_stance(duty, period, offset):
    gait = Gait("any", period, (duty,) * 4, (offset, 0.0, 0.3, 0.9))
    flags = gait.stands((np.arange(2000) + 0.5) / 2000)
    np.testing.assert_allclose(flags.mean(axis=0), duty, atol=1.1e-3)


def test_contact_is_a_function_of_time_whatever_the_sampling():
    clock = GaitClock(gaits.trot())
    clock.change(gaits.crawl(), time=0.8)
    fine = np.arange(0, 300) * DT / 3
    np.testing.assert_array_equal(clock.contacts(fine)[::3], clock.contacts(fine[::3]))


def test_rounded_instants_do_not_flicker():
    # k dt accumulates rounding errors; the pattern must repeat exactly all the same.
    flags = np.array(pattern(gaits.trot(period=14 / 30), 14 * 200)).reshape(200, 14, 4)
    assert (flags == flags[0]).all()


def test_change_waits_for_the_end_of_the_cycle():
    clock = GaitClock(gaits.trot(period=0.5))
    assert clock.change(gaits.pace(period=0.4), time=1.2) == pytest.approx(1.5)
    assert clock.gait(1.49).name == "trot"
    assert clock.gait(1.5).name == "pace"
    assert clock.phase(1.6) == pytest.approx(0.25)


def test_change_on_a_cycles_end_happens_there():
    clock = GaitClock(gaits.trot(period=14 / 30))
    assert clock.change(gaits.stand(), time=28 * DT) == pytest.approx(28 * DT)


def test_change_from_stand_and_at_once_do_not_wait():
    clock = GaitClock(gaits.stand())
    assert clock.change(gaits.trot(), time=0.123) == 0.123
    assert clock.change(gaits.bound(), time=0.2, at_once=True) == 0.2
    assert clock.contacts(np.array([0.1, 0.13, 0.21])).tolist() == [
        [True] * 4,
        [True, False, False, True],
        [True, True, False, False],
    ]


def test_later_changes_are_dropped():
    clock = GaitClock(gaits.stand())
    clock.change(gaits.trot(), time=5.0)
    clock.change(gaits.pace(), time=1.0)
    assert clock.gait(6.0).name == "pace"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"period": 0.0}, r"period is 0.0; it must be positive"),
        ({"period": float("nan")}, r"period is nan"),
        ({"duty": 1.2}, r"duty is \[1.2.*from 0 to 1"),
        ({"duty": -0.1}, r"duty is \[-0.1"),
        ({"duty": 0.0}, r"duty is 0 for every foot"),
    ],
)
def test_invalid_gaits_are_refused(options, message):
    with pytest.raises(ProblemError, match=message):
        gaits.trot(**options)


def test_unknown_gait_lists_the_known_ones():
    with pytest.raises(ProblemError, match=r"'gallop' is unknown.*stand, trot, pace"):
        gaits.by_name("gallop")
