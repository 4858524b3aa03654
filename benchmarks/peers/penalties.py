"""The C2 penalty, eq. 15 of De Vincenti and Coros with its signs mended, as a CasADi expression."""

from __future__ import annotations

import casadi as ca

from palanquin.errors import ProblemError
from palanquin.policies import Penalty
from palanquin.problem import RowGroup


def value(group: RowGroup, h: ca.SX) -> ca.SX:
    """S(h) for each row of a group."""
    policy = _policy(group)
    eps = policy.smoothing
    middle = h**3 / (6 * eps) + h**2 / 2 + eps * h / 2 + eps**2 / 6
    outer = ca.if_else(h >= eps, h**2 + eps**2 / 3, 0)
    return policy.stiffness * ca.if_else(ca.fabs(h) < eps, middle, outer)


def curvature(group: RowGroup, h: ca.SX) -> ca.SX:
    """S''(h) for each row of a group."""
    policy = _policy(group)
    eps = policy.smoothing
    outer = ca.if_else(h >= eps, 2, 0)
    return policy.stiffness * ca.if_else(ca.fabs(h) < eps, h / eps + 1, outer)


def _policy(group: RowGroup) -> Penalty:
    if not isinstance(group.policy, Penalty):
        raise ProblemError(f"peers take the C2 penalty only; '{group.name}' has {group.policy}")
    return group.policy
