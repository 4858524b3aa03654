"""The ground at one point as expressions: height, normal and tangents of a height map."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from palanquin.problem import Expression


@dataclass(frozen=True, eq=False)
class Ground:
    """The ground under one foot.

    Attributes:
        friction: static friction coefficient mu.
        xy: symbols of the coordinates, [2].
        z: height over `xy`.
        is_shared: whether all feet have the same.
        limits: rows that are <= 0 where the foot may stand, over `xy`, m, [n].
    """

    friction: Expression
    xy: Expression
    z: Expression
    limits: Expression
    is_shared: bool

    def height(self, xy: Expression) -> Expression:
        """z_g at `xy` [2], m."""
        return ca.substitute(self.z, self.xy, xy)

    def frame(self, xy: Expression) -> tuple[Expression, Expression, Expression]:
        """Unit normal n_g and unit tangents t_xz, t_yz in the xz- and yz-planes at `xy`, [3]."""
        slope = ca.substitute(ca.densify(ca.gradient(self.z, self.xy)), self.xy, xy)
        return (
            _unit(ca.vertcat(-slope[0], -slope[1], 1)),
            _unit(ca.vertcat(1, 0, slope[0])),
            _unit(ca.vertcat(0, 1, slope[1])),
        )


def _unit(v: Expression) -> Expression:
    return v / ca.sqrt(ca.dot(v, v))
