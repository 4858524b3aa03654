"""Inputs that may keep their value for several knots: fewer variables for the same horizon."""

from __future__ import annotations

import casadi as ca

from palanquin.problem import Expression, Problem, Role


def held_input(
    problem: Problem,
    name: str,
    hold: Expression | None,
    exists: Expression | float = 1.0,
    existed: Expression | float = 1.0,
) -> Expression:
    """Adds an input [3] that is carried on from the knot before where `hold` is set.

    Args:
        problem: to which it is added.
        name: of its block.
        hold: flag of the knot; None for an input that is free at every knot.
        exists: flag; elsewhere the input is absent.
        existed: the same of the knot before: an input that begins is free.
    """
    if hold is None:
        return problem.variable(name, 3, role=ca.if_else(exists, Role.INPUT, Role.ABSENT))
    held = hold * exists * existed
    role = ca.if_else(exists, ca.if_else(held, Role.CARRIED, Role.INPUT), Role.ABSENT)
    return problem.variable(name, 3, role=role)
