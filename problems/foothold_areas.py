"""Ground of which only convex areas may be stepped on: stones, stairs, walkways.

De Vincenti and Coros name the idea after (11): a passable convex area is an intersection of
half-spaces a . p + b <= 0. Each area here is a polygon over which the ground is a plane of its own.
Which area a foothold belongs to is a choice that no gradient makes: every start of a planner has
made it, and a foot's half-spaces and plane are run-time parameters that follow from it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from palanquin import _core
from palanquin.errors import ProblemError
from palanquin.problems import checks
from palanquin.problems.height_map import TREND_WIDTH, HeightMap
from palanquin.problems.terrains import Terrain

_TREND_SPACING = 0.05  # m
_CELL = 0.05  # of the grid in which the engine looks areas up, m
_MOST_CELLS = 4_000_000


@dataclass(frozen=True, eq=False)
class FootholdArea:
    """A convex polygon and the plane z = z0 + ax x + ay y over it.

    Attributes:
        corners: (x, y) in order, m, [n, 2], n >= 3; either way round.
        plane: (z0, ax, ay) in m and m/m.

    Raises ProblemError unless the polygon is convex and has an area.
    """

    corners: np.ndarray
    plane: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        given = np.asarray(self.corners, dtype=float)
        if given.ndim != 2 or len(given) < 3:
            raise ProblemError(f"area: corners have shape {given.shape}; (n, 2), n >= 3, is needed")
        corners = checks.array("area: corners", given, len(given), 2)
        checks.array("area: plane", self.plane, 3)
        sides = np.roll(corners, -1, axis=0) - corners
        following = np.roll(sides, -1, axis=0)
        turns = sides[:, 0] * following[:, 1] - sides[:, 1] * following[:, 0]
        if not ((turns > 0).all() or (turns < 0).all()):
            raise ProblemError(
                f"area: corners {corners.tolist()} do not go round a convex polygon without "
                "straight corners"
            )
        object.__setattr__(self, "corners", corners if turns[0] > 0 else corners[::-1])

    @staticmethod
    def rectangle(
        centre: Sequence[float],
        size: Sequence[float],
        z: float = 0.0,
        yaw: float = 0.0,
        slope: float = 0.0,
    ) -> FootholdArea:
        """A rectangle of `size` (length, width), m, around `centre` (x, y), turned by `yaw`, rad.

        Its height is `z`, m, in the middle and rises by `slope`, m/m, along its length.
        """
        cos, sin = np.cos(yaw), np.sin(yaw)
        length, width = checks.positive_array("area: size", size, 2)
        offsets = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * np.array([length, width]) / 2
        x, y = checks.array("area: centre", centre, 2)
        corners = np.array([x, y]) + offsets @ np.array([[cos, sin], [-sin, cos]])
        ax, ay = slope * cos, slope * sin
        return FootholdArea(corners, (z - ax * x - ay * y, ax, ay))

    def half_spaces(self, margin: float = 0.0) -> np.ndarray:
        """(a, b, c) [n, 3] with a x + b y + c <= 0 at points inside, at least `margin` from the
        sides; a^2 + b^2 = 1, m.
        """
        sides = np.roll(self.corners, -1, axis=0) - self.corners
        normals = np.column_stack([sides[:, 1], -sides[:, 0]])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return np.column_stack([normals, margin - (normals * self.corners).sum(axis=1)])

    def edge(self) -> np.ndarray:
        """The corners on the ground, m, [n, 3]."""
        z0, ax, ay = self.plane
        return np.column_stack([self.corners, z0 + self.corners @ [ax, ay]])

    def shrunk(self, margin: float) -> np.ndarray:
        """Corners [m, 2] of the polygon inside, `margin` from all sides; fewer if one vanishes."""
        lines = self.half_spaces(margin)
        pairs = zip(np.roll(lines, 1, axis=0), lines, strict=True)
        corners = np.array([np.linalg.solve([a[:2], b[:2]], [-a[2], -b[2]]) for a, b in pairs])
        outside = (corners @ lines[:, :2].T + lines[:, 2]).max(axis=1)
        return corners[outside < 1e-9]


@dataclass(frozen=True, eq=False)
class FootholdAreas(Terrain):
    """Areas that feet may stand on; elsewhere they may not.

    Where there is no area, the height is that of the nearest one, so that references exist
    everywhere.

    Attributes:
        areas: at least one.
        margin: how far from an area's sides footholds keep, m.
        sides: how many sides the compiled code foresees; areas with fewer fit.
    """

    areas: tuple[FootholdArea, ...]
    margin: float = 0.02
    sides: int = 6

    def __post_init__(self) -> None:
        checks.non_negative("areas: margin", self.margin)
        if not self.areas:
            raise ProblemError("areas: there is none; feet must stand somewhere")
        for i, area in enumerate(self.areas):
            if len(area.corners) > self.sides:
                raise ProblemError(
                    f"areas[{i}] has {len(area.corners)} sides; at most {self.sides} are possible"
                )
            if len(area.shrunk(self.margin)) < len(area.corners):
                raise ProblemError(
                    f"areas[{i}] is too small for footholds {self.margin} m from all its sides"
                )
        corners = np.concatenate([area.corners for area in self.areas])
        length, width = np.ptp(corners, axis=0)
        if length * width > _MOST_CELLS * _CELL**2:
            raise ProblemError(
                f"areas: they lie {length:.4g} m x {width:.4g} m apart; at most "
                f"{_MOST_CELLS * _CELL**2:.0f} m^2 are possible"
            )

    def parameters(self) -> Mapping[str, np.ndarray]:
        """None that all feet share."""
        return {}

    def local_parameters(self) -> Mapping[str, tuple[int, ...]]:
        """A foothold's half-spaces `sides` (a, b, c) and its `plane` (z0, ax, ay)."""
        return {"sides": (self.sides, 3), "plane": (3,)}

    def expression(self, x: ca.SX, y: ca.SX, parameters: Mapping[str, ca.SX]) -> ca.SX:
        """The plane of the foothold's area."""
        z0, ax, ay = ca.vertsplit(parameters["plane"])
        return z0 + ax * x + ay * y

    def limits(self, x: ca.SX, y: ca.SX, parameters: Mapping[str, ca.SX]) -> ca.SX:
        """Distances from the half-spaces of the foothold's area, m, [sides]; negative inside."""
        return parameters["sides"] @ ca.vertcat(x, y, 1)

    @property
    def has_gaps(self) -> bool:
        """True: only areas may be stepped on."""
        return True

    def outside(self, points: np.ndarray) -> np.ndarray:
        """By how much points [..., >= 2] miss the nearest area's sides, m; at most 0 inside."""
        xy = np.ascontiguousarray(points[..., :2], dtype=float)
        return self.core.excess(xy.reshape(-1, 2)).reshape(xy.shape[:-1]) - self.margin

    @cached_property
    def trend(self) -> Terrain:
        """The heights of the areas, smoothed over the size of a robot's body."""
        ground = self._engine(None)
        low, high = self._extent
        x, y = (
            np.arange(a - 3 * TREND_WIDTH, b + 3 * TREND_WIDTH + _TREND_SPACING, _TREND_SPACING)
            for a, b in zip(low, high, strict=True)
        )
        points = np.stack(np.meshgrid(x, y), axis=-1)
        heights = ground.heights(points.reshape(-1, 2)).reshape(points.shape[:-1])
        return HeightMap(heights, (float(x[0]), float(y[0])), _TREND_SPACING).trend

    @cached_property
    def core(self) -> _core.FootholdAreas:
        """As the engine has it."""
        return self._engine(self.trend.core)

    def _engine(self, trend: _core.Terrain | None) -> _core.FootholdAreas:
        parts = zip(self._half_spaces, self._allowed, self.areas, strict=True)
        areas = [
            (lines, corners, np.array(area.plane, dtype=float)) for lines, corners, area in parts
        ]
        return _core.FootholdAreas(areas, *self._extent, trend)

    @property
    def _extent(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and largest (x, y) of all corners, m."""
        corners = np.concatenate([area.corners for area in self.areas])
        return corners.min(axis=0), corners.max(axis=0)

    @cached_property
    def _half_spaces(self) -> np.ndarray:
        """[areas, sides, 3]; missing ones hold everywhere."""
        padded = np.tile([0.0, 0.0, -1.0], (len(self.areas), self.sides, 1))
        for own, area in zip(padded, self.areas, strict=True):
            own[: len(area.corners)] = area.half_spaces(self.margin)
        return padded

    @cached_property
    def _allowed(self) -> np.ndarray:
        """Corners of the areas, shrunk by the margin, [areas, sides, 2]; the last ones repeated."""
        shrunk = [area.shrunk(self.margin) for area in self.areas]
        padding = [(0, self.sides - len(corners)) for corners in shrunk]
        return np.array(
            [np.pad(c, (p, (0, 0)), "edge") for c, p in zip(shrunk, padding, strict=True)]
        )


def nearest_in_polygons(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points [..., 2] of convex polygons (corners anticlockwise, [..., n, 2]) nearest to `points`.

    Corners may be repeated.
    """
    flat = corners.reshape(-1, *corners.shape[-2:])
    pairs = zip(flat, points.reshape(-1, 2), strict=True)
    return np.reshape([_core.nearest_in_polygon(c, p) for c, p in pairs], points.shape)
