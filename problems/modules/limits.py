"""How the inequality families of the modules enter a problem unless told otherwise."""

from __future__ import annotations

import casadi as ca

from palanquin.policies import Penalty
from palanquin.problem import Expression

# Rows of forces count in units of 100 N, so that one stiffness suits metres and newtons alike.
FORCE_UNIT = 100.0
# Rows of torques in what a strong joint of these robots gives, N m.
TORQUE_UNIT = 40.0

# Stiffer than Table I of De Vincenti and Coros (K = 42 for all, forces in N), which leaves feet
# 2 cm inside a ditch.
REACH_POLICY = Penalty(stiffness=42000.0, smoothing=1e-3)
FORCE_POLICY = Penalty(stiffness=420.0, smoothing=1e-3)
TORQUE_POLICY = Penalty(stiffness=420.0, smoothing=1e-3)

_TINY_SQUARED = 1e-12  # m^2


def smooth_norm(v: Expression) -> Expression:
    """|v|, with a derivative at zero; 1e-6 there and relatively 1e-12 off at 0.4 m."""
    return ca.sqrt(ca.dot(v, v) + _TINY_SQUARED)
