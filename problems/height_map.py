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

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from palanquin import _core
from palanquin.errors import ProblemError
from palanquin.problems import checks
from palanquin.problems.terrains import Terrain
from palanquin.schema import LARGEST

TREND_WIDTH = 0.25
"""Standard deviation of the smoothing that gives the ground as bodies follow it, m."""

MOST_SAMPLES = 4096
"""Along each axis; the spline solves a dense system of so many equations."""

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

    def expression(self, x: ca.SX, y: ca.SX, parameters: Mapping[str, ca.SX]) -> ca.SX:
        """The expansion."""
        centre = parameters["centre"]
        z, zx, zy, zxx, zxy, zyy = ca.vertsplit(parameters["surface"])
        dx, dy = x - centre[0], y - centre[1]
        return z + zx * dx + zy * dy + zxx * dx**2 / 2 + zxy * dx * dy + zyy * dy**2 / 2

    @cached_property
    def trend(self) -> Terrain:
        """The map smoothed over the size of a robot's body."""
        if self.is_smooth:
            return self
        smoothed = _smoothed(self.heights, TREND_WIDTH / self.spacing)
        return HeightMap(smoothed, self.origin, self.spacing, is_smooth=True)

    @cached_property
    def core(self) -> _core.Terrain:
        """As the engine has it."""
        trend = None if self.is_smooth else self.trend.core
        return _core.HeightMap(
            self._coefficients, np.array(self.origin, float), self.spacing, trend
        )

    @property
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
