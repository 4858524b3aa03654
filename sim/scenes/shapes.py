"""Convex shapes that our robots' shells are made of, as vertices whose convex hull is the shape."""

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def chamfered_box(size: tuple[float, float, float], chamfer: float) -> Array:
    """Vertices [24, 3] of a box of full extents `size` (m) centred at the origin, with its edges
    cut by `chamfer` (m).
    """
    half = np.asarray(size) / 2
    corners = []
    for signs in itertools.product((-1.0, 1.0), repeat=3):
        for axis in range(3):
            inset = np.full(3, chamfer)
            inset[axis] = 0.0
            corners.append(np.asarray(signs) * (half - inset))
    return np.array(corners)


def belt(
    start: Sequence[float],
    end: Sequence[float],
    radii: tuple[float, float],
    thickness: float,
    chamfer: float,
    segments: int = 20,
) -> Array:
    """Vertices of the hull of two discs whose axes are y, like a belt around two pulleys.

    `start`, `end` [3] are the discs' centres (m), `radii` theirs, `thickness` the extent along y,
    `chamfer` the cut of the rim. This is the shape of a thigh between its two motors.
    """
    angle = np.arange(segments) * 2 * np.pi / segments
    rim = np.stack([np.cos(angle), np.zeros(segments), np.sin(angle)], axis=1)
    rings = []
    for centre, radius in ((start, radii[0]), (end, radii[1])):
        for y, r in (
            (-thickness / 2, radius - chamfer),
            (chamfer - thickness / 2, radius),
            (thickness / 2 - chamfer, radius),
            (thickness / 2, radius - chamfer),
        ):
            rings.append(np.asarray(centre) + r * rim + np.array([0.0, y, 0.0]))
    return np.concatenate(rings)


def tapered_trunk(
    size: tuple[float, float, float], shoulder: float, nose: float, chamfer: float
) -> Array:
    """Vertices of a trunk of full extents `size` (m): narrower by `shoulder` (m) at the top edges
    and by `nose` (m) at both ends, with edges cut by `chamfer` (m).
    """
    x, y, z = np.asarray(size) / 2
    sections = (
        (-x, y - nose, z - nose / 2),
        (-x + 2 * nose, y, z),
        (x - 2 * nose, y, z),
        (x, y - nose, z - nose / 2),
    )
    points = []
    for at, half_width, half_height in sections:
        for sign in (-1.0, 1.0):
            points += [
                (at, sign * (half_width - shoulder), half_height),
                (at, sign * half_width, half_height - shoulder),
                (at, sign * half_width, -half_height + chamfer),
                (at, sign * (half_width - chamfer), -half_height),
            ]
    return np.array(points)
