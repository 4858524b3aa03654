"""Foothold choices at ditches: every start is a valid one, and they differ where they may."""

from pathlib import Path

import numpy as np
import pytest

from palanquin.problems import clm, terrains
from palanquin.problems.clm.starts import cheapest_combinations, foothold_starts

CASES = Path(__file__).parents[1] / "data" / "cases"
GROUND = terrains.Plane(0.0, 0.2, 0.0)


def depths(points, lines):
    distance = np.abs(points[..., :2] @ lines[:, :2].T + lines[:, 2])
    return lines[:, 3] / 2 - distance / np.hypot(lines[:, 0], lines[:, 1])


@pytest.fixture
def landing():
    """One robot whose front feet land at knot 2, LF in a ditch."""
    contacts = np.ones((4, 1, 4))
    contacts[:2, 0, :2] = 0
    before = contacts[0]
    wanted = np.zeros((4, 1, 4, 3))
    wanted[:, 0, 0, 0] = 0.55
    return wanted, contacts, before


def landed(start):
    return start[2, 0, 0]


def test_both_edges_of_a_ditch_are_tried(landing):
    lines = np.array([[1.0, 0.0, -0.5, 0.3]])
    starts = foothold_starts(*landing, GROUND, lines, at_most=8)
    assert len(starts) == 2
    assert landed(starts[0])[0] == pytest.approx(0.66)  # the nearer edge and a margin
    assert landed(starts[1])[0] == pytest.approx(0.34)
    for start in starts:
        assert landed(start)[2] == pytest.approx(GROUND.height(*landed(start)[:2]))
        np.testing.assert_array_equal(start[2, 0, 1:], landing[0][2, 0, 1:])


def test_feet_go_on_through_adjoining_ditches(landing):
    lines = np.array([[1.0, 0.0, -0.5, 0.3], [1.0, 0.1, -0.7, 0.2]])
    for start in foothold_starts(*landing, GROUND, lines, at_most=8):
        assert depths(landed(start), lines).max() < 0


def test_without_ditches_the_wanted_feet_are_the_only_start(landing):
    (start,) = foothold_starts(*landing, terrains.Flat(), np.empty((0, 4)), at_most=8)
    np.testing.assert_array_equal(start, landing[0])


def test_combinations_come_cheapest_first_and_once_each():
    random = np.random.default_rng(3)
    costs = [random.random(n) for n in (3, 1, 4, 2)]
    found = cheapest_combinations(costs, at_most=30)
    assert len(set(found)) == len(found) == 24
    totals = [sum(cost[i] for cost, i in zip(costs, picked, strict=True)) for picked in found]
    np.testing.assert_allclose(totals, sorted(totals))


def test_no_landing_has_one_combination():
    assert cheapest_combinations([], at_most=2) == [()]


def test_at_most_so_many_and_none_twice():
    case = clm.CaseProblem.of(clm.load_case(CASES / "ditch.json"))
    starts = case.starts(at_most=6)
    assert len(starts) == 6
    assert len({start.tobytes() for start in starts}) == 6
    assert len(case.starts(at_most=1)) == 1
