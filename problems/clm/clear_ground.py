"""Ground outside of ditches: how deep a point lies in one, and the way out."""

from __future__ import annotations

import numpy as np

from palanquin import _core


def ditch_depths(xy: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """Depths [..., m] (11) of points [..., 2] in ditches (a, b, c, d), [m, 4]; negative outside."""
    depths = _core.Ditches(lines).depths(np.reshape(xy, (-1, 2)))
    return depths.reshape(*np.shape(xy)[:-1], len(lines))


def nearest_clear(xy: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """Points [n, 2] outside of all ditches: `xy` themselves, or the nearer way out."""
    return _core.Ditches(lines).nearest_clear(xy)


def leave_ditches(xy: np.ndarray, lines: np.ndarray, nearer: bool) -> np.ndarray:
    """Points [n, 2] moved out of their deepest ditch, and on out of further ones the same way.

    Args:
        xy: points, m.
        lines: ditches (a, b, c, d), [m, 4].
        nearer: over the nearer edge of the deepest ditch, or over the other one.
    """
    return _core.Ditches(lines).leave(xy, nearer)
