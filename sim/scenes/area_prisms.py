"""Foothold areas as pictures show them: prisms that stand on a floor below all of them."""

import numpy as np
from numpy.typing import NDArray

from palanquin.problems.foothold_areas import FootholdArea, FootholdAreas

Array = NDArray[np.float64]

DEPTH = 0.25
"""Of the floor below the lowest area, m."""


def floor_below(ground: FootholdAreas) -> float:
    """Z of the floor, m."""
    return float(min(area.edge()[:, 2].min() for area in ground.areas)) - DEPTH


def prism(area: FootholdArea, floor: float) -> tuple[Array, NDArray[np.int32]]:
    """Corners [2 n, 3] (m) and triangles [4 n - 4, 3] of the prism from `floor` up to an area."""
    n = len(area.corners)
    top = area.edge()
    bottom = np.column_stack([area.corners, np.full(n, floor)])
    fan = np.array([(0, i, i + 1) for i in range(1, n - 1)])
    side = [(i, n + i, n + (i + 1) % n) for i in range(n)]
    side += [(i, n + (i + 1) % n, (i + 1) % n) for i in range(n)]
    triangles = np.concatenate([fan, n + fan[:, ::-1], side])
    return np.concatenate([top, bottom]), triangles.astype(np.int32)
