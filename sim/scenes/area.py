"""The part of the ground that a picture shows."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palanquin.problems.terrains import Terrain

Array = NDArray[np.float64]

TILE = 0.5
"""Side of the ground's tiles (m): a scale for the eye."""


@dataclass(frozen=True)
class Area:
    """A rectangle of the ground, world frame, m."""

    x_min: float
    x_max: float
    y_min: float
    y_max: float

    @classmethod
    def around(cls, points: Array, margin: float) -> "Area":
        """The bounding rectangle of `points` [n, >=2], widened by `margin` and rounded to tiles."""
        low = np.floor((points.min(axis=0)[:2] - margin) / TILE) * TILE
        high = np.ceil((points.max(axis=0)[:2] + margin) / TILE) * TILE
        return cls(float(low[0]), float(high[0]), float(low[1]), float(high[1]))

    @property
    def centre(self) -> Array:
        """Its middle [2]."""
        return np.array([self.x_min + self.x_max, self.y_min + self.y_max]) / 2

    @property
    def half(self) -> Array:
        """Half its sides [2]."""
        return np.array([self.x_max - self.x_min, self.y_max - self.y_min]) / 2

    def surface(self, ground: Terrain, spacing: float) -> Array:
        """Points [rows, columns, 3] of the ground on a grid at most `spacing` apart (m); rows run
        along y, columns along x.
        """
        columns = int(np.ceil((self.x_max - self.x_min) / spacing - 1e-9)) + 1
        rows = int(np.ceil((self.y_max - self.y_min) / spacing - 1e-9)) + 1
        x, y = np.meshgrid(
            np.linspace(self.x_min, self.x_max, columns), np.linspace(self.y_min, self.y_max, rows)
        )
        return np.stack([x, y, ground.height(x, y)], axis=-1)

    def segment(self, a: float, b: float, c: float) -> tuple[Array, Array] | None:
        """Both ends [2] of the part of the line a x + b y + c = 0 inside the area, or None."""
        normal = np.array([a, b])
        scale = np.linalg.norm(normal)
        direction = np.array([-b, a]) / scale
        nearest = -c * normal / scale**2  # the line's point nearest to the origin
        low, high = -np.inf, np.inf
        for axis, bounds in enumerate(((self.x_min, self.x_max), (self.y_min, self.y_max))):
            if abs(direction[axis]) < 1e-9:
                if not bounds[0] <= nearest[axis] <= bounds[1]:
                    return None
                continue
            near, far = sorted((np.array(bounds) - nearest[axis]) / direction[axis])
            low, high = max(low, near), min(high, far)
        if low >= high:
            return None
        return nearest + low * direction, nearest + high * direction
