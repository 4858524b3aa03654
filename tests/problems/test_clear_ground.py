"""Ways out of ditches: they end on clear ground, the nearer one is taken, clear points stay."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from palanquin.problems.clm.clear_ground import ditch_depths, leave_ditches, nearest_clear

ALONG_Y = np.array([[1.0, 0.0, -0.5, 0.3], [1.0, 0.0, -1.0, 0.2]])


def test_points_leave_over_the_nearer_edge_or_the_other():
    points = np.array([[0.45, 2.0], [0.55, -1.0], [0.2, 0.0], [0.95, 0.0]])
    nearer = leave_ditches(points, ALONG_Y, nearer=True)
    np.testing.assert_allclose(nearer[:, 0], [0.34, 0.66, 0.2, 0.89])
    other = leave_ditches(points, ALONG_Y, nearer=False)
    np.testing.assert_allclose(other[:, 0], [0.66, 0.34, 0.2, 1.11])
    np.testing.assert_array_equal(nearer[:, 1], points[:, 1])


def test_the_nearer_edge_is_not_the_nearer_way_out_of_adjoining_ditches():
    lines = np.array([[1.0, 0.0, -0.5, 0.3], [1.0, 0.0, -0.8, 0.3]])
    np.testing.assert_allclose(nearest_clear(np.array([[0.55, 0.0]]), lines), [[0.34, 0.0]])


@given(st.integers(0, 2**32 - 1))
def test_nothing_stays_in_a_ditch(seed):
    random = np.random.default_rng(seed)
    angles = random.uniform(-0.3, 0.3, 6)
    centres = np.cumsum(random.uniform(0.3, 0.6, 6))
    lines = np.column_stack([np.cos(angles), np.sin(angles), -centres, random.uniform(0, 0.32, 6)])
    points = random.uniform([0.0, -0.3], [3.0, 0.3], (50, 2))
    clear = nearest_clear(points, lines)
    assert (ditch_depths(clear, lines) <= 1e-12).all()
    stays = (ditch_depths(points, lines) <= 0).all(axis=-1)
    np.testing.assert_array_equal(clear[stays], points[stays])
