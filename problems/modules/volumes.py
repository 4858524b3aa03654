"""Volumes of bodies, and smooth signed distances between them and prisms on the ground.

A body fills a capsule: a segment that is fixed to it, with a radius. An obstacle is an upright
prism over a rectangle with rounded corners; without rounding it is a box or a wall, of rounding
alone a cylinder. Distances are those of the shapes themselves, not of samples of them: the distance
of a point from a convex set has a continuous gradient outside of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from palanquin.problem import Expression
from palanquin.problems.modules.rigid_body import Body

_TINY = 1e-12  # m^2


@dataclass(frozen=True, eq=False)
class Capsule:
    """A segment with a radius, fixed to a body.

    Attributes:
        name: of the body.
        ends: of the segment in the world, m, two of [3].
        radius: m.
    """

    name: str
    ends: tuple[Expression, Expression]
    radius: Expression

    @staticmethod
    def of(body: Body, shape: Expression) -> Capsule:
        """The capsule of `shape` [7]: both ends in body axes, m, and the radius, m."""
        first, second = (body.position + body.offset(shape[i : i + 3]) for i in (0, 3))
        return Capsule(body.name, (first, second), shape[6])

    def nearest(self, point: Expression, size: int) -> Expression:
        """The point [3] of the segment nearest to `point`, counting the first `size` entries."""
        first, second = self.ends
        along, to = (second - first)[:size], point[:size] - first[:size]
        share = ca.dot(along, to) / (ca.dot(along, along) + _TINY)
        return first + ca.fmin(ca.fmax(share, 0), 1) * (second - first)

    def centres(self, count: int) -> list[Expression]:
        """Centres [3] of `count` spheres along the segment, its ends included."""
        first, second = self.ends
        return [first + i / (count - 1) * (second - first) for i in range(count)]


@dataclass(frozen=True, eq=False)
class Prism:
    """An obstacle: a rectangle around `centre`, turned by `yaw`, its corners rounded, up to `top`.

    Attributes:
        centre: (x, y), m, [2].
        yaw: rad.
        half: half of the rectangle's sides without the rounding, m, [2].
        rounding: m.
        top: z, m; it reaches down for ever.
    """

    centre: Expression
    yaw: Expression
    half: Expression
    rounding: Expression
    top: Expression

    @staticmethod
    def of(row: Expression) -> Prism:
        """The obstacle of (x, y, yaw, half length, half width, rounding, top), [1, 7]."""
        x, y, yaw, length, width, rounding, top = ca.horzsplit(row)
        return Prism(ca.vertcat(x, y), yaw, ca.vertcat(length, width), rounding, top)

    @property
    def exists(self) -> Expression:
        """Nonzero unless its rectangle and its rounding are of size 0."""
        return self.half[0] + self.half[1] + self.rounding > 0

    def corners(self) -> list[tuple[Expression, Expression]]:
        """Corners [2] of the rectangle, each with a flag that is 0 where it repeats another."""
        signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
        wide, deep = self.half[0] > 0, self.half[1] > 0
        distinct = (ca.SX(1), wide, wide * deep, deep)
        turn = self._turn()
        return [
            (self.centre + turn @ (self.half * ca.DM(sign)), self.exists * flag)
            for sign, flag in zip(signs, distinct, strict=True)
        ]

    def distance(self, point: Expression) -> Expression:
        """Signed distance of a point [3], m; negative inside."""
        excess = ca.fabs(self._turn().T @ (point[:2] - self.centre)) - self.half
        outside = _norm(ca.fmax(excess, 0))
        inside = ca.fmin(ca.fmax(excess[0], excess[1]), 0)
        return self._with_height(outside + inside - self.rounding, point[2])

    def distance_of_corner(self, corner: Expression, capsule: Capsule) -> Expression:
        """Distance of the upright edge at `corner` [2] from a capsule's segment, m."""
        point = capsule.nearest(corner, 2)
        return self._with_height(_norm(point[:2] - corner) - self.rounding, point[2])

    def _with_height(self, sideways: Expression, z: Expression) -> Expression:
        """The distance of a point at `z` whose signed distance seen from above is `sideways`."""
        above = z - self.top
        outside = _norm(ca.fmax(ca.vertcat(sideways, above), 0))
        return outside + ca.fmin(ca.fmax(sideways, above), 0)

    def _turn(self) -> Expression:
        cos, sin = ca.cos(self.yaw), ca.sin(self.yaw)
        return ca.blockcat([[cos, -sin], [sin, cos]])


def distance_from_capsule(point: Expression, capsule: Capsule) -> Expression:
    """Distance of a point [3] from a capsule's segment, m."""
    return _norm(point - capsule.nearest(point, 3))


def _norm(v: Expression) -> Expression:
    return ca.sqrt(ca.dot(v, v) + _TINY)
