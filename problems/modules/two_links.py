"""Plane kinematics of limbs of two links: where the joint between them is."""

from __future__ import annotations

import casadi as ca

from palanquin.problem import Expression

_STRETCHED = 1e-3  # m^2: below it a square root gives way to a smooth one
_TINY = 1e-9  # m^2


def bend(
    end: tuple[Expression, Expression], first: Expression, second: Expression, side: int
) -> tuple[Expression, Expression]:
    """The joint between two links from (0, 0) to `end`, in the plane of them, m.

    Args:
        end: (x, z) of the second link's end.
        first: length of the link from (0, 0).
        second: length of the other one.
        side: 1 where the joint is left of the line to `end` seen with x to the right and z up,
            -1 right of it.
    """
    x, z = end
    square = x**2 + z**2 + _TINY
    along = (square + first**2 - second**2) / (2 * square)  # share of the line to `end`
    across = side * root(first**2 - along**2 * square) / ca.sqrt(square)
    return along * x - across * z, along * z + across * x


def root(square: Expression) -> Expression:
    """Square root, with a slope everywhere: where a limb is stretched or out of reach too."""
    return ca.sqrt((square + ca.sqrt(square**2 + _STRETCHED**2)) / 2)
