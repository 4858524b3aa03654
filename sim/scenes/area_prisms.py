"""Ground in pieces: prisms that stand on a floor below all of them, with gaps between."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from palanquin.problems.foothold_areas import FootholdArea, FootholdAreas
from palanquin.problems.terrains import Terrain
from palanquin.sim.scenarios.team import Ditch
from palanquin.sim.scenes.area import Area

Array = NDArray[np.float64]

DEPTH = 0.25
"""Of the floor below the lowest area, or of ditches, m."""


def floor_below(ground: FootholdAreas) -> float:
    """Z of the floor, m."""
    return float(min(area.edge()[:, 2].min() for area in ground.areas)) - DEPTH


def prism(area: FootholdArea, floor: Array | float) -> tuple[Array, NDArray[np.int32]]:
    """Corners [2 n, 3] (m) and triangles [4 n - 4, 3] of the prism from `floor`, of all corners or
    each, up to an area.
    """
    n = len(area.corners)
    top = area.edge()
    bottom = np.column_stack([area.corners, np.broadcast_to(floor, n)])
    fan = np.array([(0, i, i + 1) for i in range(1, n - 1)])
    side = [(i, n + i, n + (i + 1) % n) for i in range(n)]
    side += [(i, n + (i + 1) % n, (i + 1) % n) for i in range(n)]
    triangles = np.concatenate([fan, n + fan[:, ::-1], side])
    return np.concatenate([top, bottom]), triangles.astype(np.int32)


def between_ditches(ground: Terrain, ditches: Iterable[Ditch], area: Area) -> list[FootholdArea]:
    """The pieces of planar ground that ditches leave of `area`."""
    left, right = area.centre[0] - area.half[0], area.centre[0] + area.half[0]
    low, high = area.centre[1] - area.half[1], area.centre[1] + area.half[1]
    pieces = [np.array([[left, low], [right, low], [right, high], [left, high]])]
    for ditch in ditches:
        normal = np.array([ditch.a, ditch.b]) / np.hypot(ditch.a, ditch.b)
        offset = ditch.c / np.hypot(ditch.a, ditch.b)
        sides = [(normal, offset + ditch.d / 2), (-normal, -offset + ditch.d / 2)]
        pieces = [cut(piece, *side) for piece in pieces for side in sides]
        pieces = [piece for piece in pieces if len(piece)]
    z0 = float(ground.height(0.0, 0.0))
    ax, ay = (float(ground.height(*step)) - z0 for step in ((1.0, 0.0), (0.0, 1.0)))
    return [FootholdArea(piece, (z0, ax, ay)) for piece in pieces]


def cut(polygon: Array, normal: Array, offset: float) -> Array:
    """What of a convex polygon [n, 2] lies where normal . p + offset <= 0 [m, 2]; maybe nothing."""
    depths = polygon @ normal + offset
    corners = []
    for p, q, a, b in zip(
        polygon, np.roll(polygon, -1, axis=0), depths, np.roll(depths, -1), strict=True
    ):
        if a <= 0:
            corners.append(p)
        if min(a, b) < 0 < max(a, b):
            corners.append(p + a / (a - b) * (q - p))
    return np.array(corners) if len(corners) > 2 else np.empty((0, 2))
