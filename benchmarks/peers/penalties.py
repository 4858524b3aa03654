"""How penalised rows enter an objective: the engine's penalties written down a second time."""

from __future__ import annotations

import casadi as ca

from palanquin.errors import ProblemError
from palanquin.policies import Penalty, RelaxedBarrier, SquaredHinge
from palanquin.problem import RowGroup


def value(group: RowGroup, h: ca.SX) -> ca.SX:
    """S(h) for each row of a group, whose policy is a penalty."""
    policy = group.policy
    if isinstance(policy, Penalty):
        return _blended_square(policy, h)
    if isinstance(policy, SquaredHinge):
        return policy.stiffness * ca.fmax(h, 0) ** 2
    if isinstance(policy, RelaxedBarrier):
        mu, delta = policy.weight, policy.relaxation
        quadratic = mu / 2 * (((h + 2 * delta) / delta) ** 2 - 1) - mu * ca.log(delta)
        return ca.if_else(h <= -delta, -mu * ca.log(ca.fmax(-h, delta)), quadratic)
    raise ProblemError(f"'{group.name}' has {policy}, which is no penalty")


def _blended_square(policy: Penalty, h: ca.SX) -> ca.SX:
    """Eq. 15 of De Vincenti and Coros with its signs mended."""
    eps = policy.smoothing
    middle = h**3 / (6 * eps) + h**2 / 2 + eps * h / 2 + eps**2 / 6
    outer = ca.if_else(h >= eps, h**2 + eps**2 / 3, 0)
    return policy.stiffness * ca.if_else(ca.fabs(h) < eps, middle, outer)


def curvature(group: RowGroup, h: ca.SX) -> ca.SX:
    """S''(h) for each row of a group that has the C2 penalty."""
    policy = group.policy
    if not isinstance(policy, Penalty):
        raise ProblemError(f"peers take the C2 penalty only; '{group.name}' has {policy}")
    eps = policy.smoothing
    outer = ca.if_else(h >= eps, 2, 0)
    return policy.stiffness * ca.if_else(ca.fabs(h) < eps, h / eps + 1, outer)
