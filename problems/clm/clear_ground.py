"""Ground outside of ditches: how deep a point lies in one, and the way out."""

from __future__ import annotations

import numpy as np

# Distance from the edge at which a point that has left a ditch comes to lie, m.
_MARGIN = 0.01


def ditch_depths(xy: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """Depths [..., m] (11) of points [..., 2] in ditches (a, b, c, d), [m, 4]; negative outside."""
    return lines[:, 3] / 2 - np.abs(_offsets(xy, lines))


def nearest_clear(xy: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """Points [n, 2] outside of all ditches: `xy` themselves, or the nearer way out."""
    ways = np.stack([leave_ditches(xy, lines, nearer) for nearer in (True, False)])
    shorter = np.linalg.norm(ways - xy, axis=-1).argmin(axis=0)
    return ways[shorter, np.arange(len(xy))]


def leave_ditches(xy: np.ndarray, lines: np.ndarray, nearer: bool) -> np.ndarray:
    """Points [n, 2] moved out of their deepest ditch, and on out of further ones the same way.

    Args:
        xy: points, m.
        lines: ditches (a, b, c, d), [m, 4].
        nearer: over the nearer edge of the deepest ditch, or over the other one.
    """
    moved, direction = np.array(xy), np.zeros_like(xy)
    normals = lines[:, :2] / np.hypot(lines[:, 0], lines[:, 1])[:, None]
    half_widths = lines[:, 3] / 2
    points = np.arange(len(moved))
    for _ in range(len(lines)):
        offsets = _offsets(moved, lines)
        depths = half_widths - np.abs(offsets)
        deepest = depths.argmax(axis=-1)
        inside = depths[points, deepest] > 0
        if not inside.any():
            break
        offset, normal = offsets[points, deepest], normals[deepest]
        outwards = np.where((offset >= 0) == nearer, 1.0, -1.0)[:, None] * normal
        direction = np.where(direction.any(axis=-1, keepdims=True), direction, outwards)
        side = np.where((normal * direction).sum(axis=-1) >= 0, 1.0, -1.0)
        step = side * (half_widths[deepest] + _MARGIN) - offset
        moved = np.where(inside[:, None], moved + step[:, None] * normal, moved)
    return moved


def _offsets(xy: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """Signed distances [..., m] of points from each ditch's centre line, m."""
    return (xy @ lines[:, :2].T + lines[:, 2]) / np.hypot(lines[:, 0], lines[:, 1])
