"""Ground from samples on a grid: a twice continuously differentiable interpolant.

A tensor-product cubic B-spline through all samples,

    z_g(x, y) = sum_ij c_ij B(u - j) B(v - i),   u = (x - x0) / h,  v = (y - y0) / h,

with the cardinal spline B (de Boor, *A Practical Guide to Splines*). Beyond its edges a map goes on
as it ends there. A planner's problem holds, as run-time parameters, the map's value, slope and
curvature at each foothold that it starts from: what an iteration of SQP sees of the map is exact,
and maps of any size use the same compiled code. After a step d the height is off by O(d^3) until
the next solve starts from there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from palanquin.errors import ProblemError
from palanquin.problems import checks
from palanquin.problems.terrains import Terrain
from palanquin.schema import LARGEST

TREND_WIDTH = 0.25
"""Standard deviation of the smoothing that gives the ground as bodies follow it, m."""

MOST_SAMPLES = 4096
"""Along each axis; the spline solves a dense system of so many equations."""

# (1, t, t^2, t^3) times these give B at the nodes -1, 0, 1, 2 of a cell, and its derivatives.
_SPLINE = np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 6
_DERIVATIVE = np.diag([1.0, 2.0, 3.0], k=1)
_SPLINES = (_SPLINE, _DERIVATIVE @ _SPLINE, _DERIVATIVE @ _DERIVATIVE @ _SPLINE)
_VALUE_AND_SLOPE = np.array(_SPLINES[:2])

_REPEATED = 8  # coefficients beyond each edge


@dataclass(frozen=True, eq=False)
class HeightMap(Terrain):
    """A height map through samples.

    Attributes:
        heights: samples, m, [rows, columns], at least 2 x 2; rows run along y, columns along x.
        origin: (x, y) of the first sample, m.
        spacing: between neighbouring samples, m, positive.
        is_smooth: whether bodies should follow it as it is, without smoothing.

    Raises ProblemError for a sample that is missing (NaN) or infinite, naming row and column.
    """

    heights: np.ndarray
    origin: tuple[float, float] = (0.0, 0.0)
    spacing: float = 0.05
    is_smooth: bool = False

    def __post_init__(self) -> None:
        checks.positive("height map: spacing", self.spacing)
        checks.array("height map: origin", self.origin, 2)
        object.__setattr__(self, "heights", checked_samples(self.heights))

    def parameters(self) -> Mapping[str, np.ndarray]:
        """None that all feet share."""
        return {}

    def local_parameters(self) -> Mapping[str, tuple[int, ...]]:
        """The `centre` (x, y) of an expansion, and there `surface` (z, zx, zy, zxx, zxy, zyy)."""
        return {"centre": (2,), "surface": (6,)}

    def around(self, points: np.ndarray) -> Mapping[str, np.ndarray]:
        """The expansion to second order around each point."""
        centre = points[..., :2]
        orders = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
        surface = self._derivatives(centre[..., 0], centre[..., 1], orders)
        return {"centre": centre, "surface": surface}

    def expression(self, x: ca.SX, y: ca.SX, parameters: Mapping[str, ca.SX]) -> ca.SX:
        """The expansion."""
        centre = parameters["centre"]
        z, zx, zy, zxx, zxy, zyy = ca.vertsplit(parameters["surface"])
        dx, dy = x - centre[0], y - centre[1]
        return z + zx * dx + zy * dy + zxx * dx**2 / 2 + zxy * dx * dy + zyy * dy**2 / 2

    def height(self, x: np.ndarray | float, y: np.ndarray | float) -> np.ndarray:
        """z_g, m, of the common shape of x and y."""
        return self._derivatives(x, y, ((0, 0),))[..., 0]

    def gradient(self, x: np.ndarray | float, y: np.ndarray | float) -> np.ndarray:
        """(dz/dx, dz/dy), shape [..., 2]."""
        return self._derivatives(x, y, ((1, 0), (0, 1)))

    @cached_property
    def trend(self) -> Terrain:
        """The map smoothed over the size of a robot's body."""
        if self.is_smooth:
            return self
        smoothed = _smoothed(self.heights, TREND_WIDTH / self.spacing)
        return HeightMap(smoothed, self.origin, self.spacing, is_smooth=True)

    def _derivatives(
        self,
        x: np.ndarray | float,
        y: np.ndarray | float,
        orders: tuple[tuple[int, int], ...],
    ) -> np.ndarray:
        """d^(m+n) z / dx^m dy^n for each (m, n) of `orders`, [..., orders]."""
        u, v = np.broadcast_arrays(*self._coordinates(x, y))
        column, row = np.floor(u).astype(int), np.floor(v).astype(int)
        cell = np.arange(-1, 3) + _REPEATED
        values = self._coefficients[
            row[..., None, None] + cell[:, None], column[..., None, None] + cell
        ]
        along, across = ((t[..., None] ** np.arange(4)) for t in (u - column, v - row))
        results = [
            np.einsum("...ij,...i,...j->...", values, across @ _SPLINES[n], along @ _SPLINES[m])
            / self.spacing ** (m + n)
            for m, n in orders
        ]
        return np.stack(results, axis=-1)

    def slope(self, x: float, y: float) -> tuple[float, float]:
        """(dz/dx, dz/dy) at one point."""
        rows, columns = self.heights.shape
        (x0, y0), least = self.origin, 2 - _REPEATED
        u = min(max((x - x0) / self.spacing, least), columns - 1 - least)
        v = min(max((y - y0) / self.spacing, least), rows - 1 - least)
        column, row = math.floor(u) - 1 + _REPEATED, math.floor(v) - 1 + _REPEATED
        values = self._coefficients[row : row + 4, column : column + 4]
        powers = np.array([[1.0, t, t * t, t * t * t] for t in (u % 1, v % 1)])
        along, across = (powers @ _VALUE_AND_SLOPE).swapaxes(0, 1)
        (_, zx), (zy, _) = (across @ values @ along.T).tolist()
        return zx / self.spacing, zy / self.spacing

    def _coordinates(self, x: np.ndarray | float, y: np.ndarray | float) -> list[np.ndarray]:
        """(u, v), clipped to where the map has become level."""
        return [
            np.clip((value - first) / self.spacing, 2 - _REPEATED, size + _REPEATED - 3)
            for value, first, size in zip(
                (x, y), self.origin, self.heights.shape[::-1], strict=True
            )
        ]

    @cached_property
    def _coefficients(self) -> np.ndarray:
        """c_ij, with those at the edges repeated beyond them."""
        rows, columns = (_interpolation_matrix(size) for size in self.heights.shape)
        coefficients = np.linalg.solve(columns, np.linalg.solve(rows, self.heights).T).T
        return np.pad(coefficients, _REPEATED, mode="edge")


def checked_samples(heights: ArrayLike) -> np.ndarray:
    """Samples as a float array; raises ProblemError that names the row and column of a bad one."""
    try:
        samples = np.array(heights, dtype=float)
    except (TypeError, ValueError) as error:
        raise ProblemError("height map: the samples are not an array of numbers") from error
    if samples.ndim != 2 or min(samples.shape) < 2:
        raise ProblemError(
            f"height map: samples have shape {samples.shape}; at least 2 rows and 2 columns are "
            "needed"
        )
    if max(samples.shape) > MOST_SAMPLES:
        raise ProblemError(
            f"height map: samples have shape {samples.shape}; at most {MOST_SAMPLES} along each "
            "axis are possible"
        )
    bad = np.argwhere(~(np.abs(samples) <= LARGEST))
    if len(bad):
        row, column = bad[0]
        more = f", and {len(bad) - 1} more are bad" if len(bad) > 1 else ""
        raise ProblemError(
            f"height map: row {row}, column {column} is {samples[row, column]}{more}; a map must "
            f"have no holes: fill them first, with magnitudes of at most {LARGEST:g}"
        )
    return samples


def _interpolation_matrix(size: int) -> np.ndarray:
    """Takes coefficients to samples: (1, 4, 1) / 6, with the edges' coefficients repeated."""
    matrix = (4 * np.eye(size) + np.eye(size, k=1) + np.eye(size, k=-1)) / 6
    matrix[0, 0] = matrix[-1, -1] = 5 / 6
    return matrix


def _smoothed(heights: np.ndarray, width: float) -> np.ndarray:
    """Gaussian smoothing along both axes, with the edges repeated; `width` counts in samples."""
    reach = int(np.ceil(3 * width))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    kernel /= kernel.sum()
    for _ in range(2):
        padded = np.pad(heights, ((reach, reach), (0, 0)), mode="edge")
        windows = np.lib.stride_tricks.sliding_window_view(padded, len(kernel), axis=0)
        heights = (windows @ kernel).T  # along the other axis next
    return heights
