"""One-step methods for x' = rate(x), as expressions: explicit and implicit Runge-Kutta methods.

    k_i = rate(x + h sum_j a_ij k_j),   x+ = x + h sum_i b_i k_i

(Hairer, Norsett and Wanner, "Solving ordinary differential equations I", 1993, II.1; implicit ones
in II, 1996, IV.5). The stages of implicit methods are found by Newton's method, whose iterations
are written out: the map that a solver sees is explicit, and its derivatives are those of the map.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import casadi as ca
import numpy as np

from palanquin.errors import ProblemError
from palanquin.statements import checked_size
from palanquin.terms import Expression

Integrator = Literal[
    "euler", "midpoint", "rk4", "implicit_euler", "implicit_midpoint", "gauss_legendre", "radau"
]
Rate = Callable[[Expression], Expression]

NEWTON_STEPS = 5
"""From k_i = rate(x): errors of e become about e^32, where the step resolves the equation."""


@dataclass(frozen=True)
class Tableau:
    """Coefficients a [s, s] and b [s] of a method with s stages."""

    a: np.ndarray
    b: np.ndarray

    @property
    def is_explicit(self) -> bool:
        """Whether every stage needs earlier ones only."""
        return not np.triu(self.a).any()


def _tableau(a: list[list[float]], b: list[float]) -> Tableau:
    return Tableau(np.array(a, float), np.array(b, float))


_ROOT = np.sqrt(3) / 6
TABLEAUS = {
    "euler": _tableau([[0]], [1]),
    "midpoint": _tableau([[0, 0], [1 / 2, 0]], [0, 1]),
    "rk4": _tableau(
        [[0, 0, 0, 0], [1 / 2, 0, 0, 0], [0, 1 / 2, 0, 0], [0, 0, 1, 0]],
        [1 / 6, 1 / 3, 1 / 3, 1 / 6],
    ),
    "implicit_euler": _tableau([[1]], [1]),
    "implicit_midpoint": _tableau([[1 / 2]], [1]),
    "gauss_legendre": _tableau([[1 / 4, 1 / 4 - _ROOT], [1 / 4 + _ROOT, 1 / 4]], [1 / 2, 1 / 2]),
    "radau": _tableau([[5 / 12, -1 / 12], [3 / 4, 1 / 4]], [3 / 4, 1 / 4]),
}


def integrate(
    rate: Rate,
    x: Expression,
    duration: Expression | float,
    integrator: Integrator = "rk4",
    steps: int = 1,
) -> Expression:
    """X after `duration` seconds of x' = rate(x), in `steps` equal steps.

    Raises:
        ProblemError: the integrator does not exist, or there are less than 1 steps.
    """
    if integrator not in TABLEAUS:
        known = ", ".join(get_args(Integrator))
        raise ProblemError(f"integrator is {integrator!r}; it must be one of {known}")
    tableau, h = TABLEAUS[integrator], duration / checked_size("integrator steps", steps)
    find = _explicit_stages if tableau.is_explicit else _implicit_stages
    for _ in range(steps):
        stages = find(rate, x, h, tableau)
        x = x + h * sum(b * k for b, k in zip(tableau.b, stages, strict=True) if b)
    return x


def _explicit_stages(
    rate: Rate, x: Expression, h: Expression | float, tableau: Tableau
) -> list[Expression]:
    stages: list[Expression] = []
    for row in tableau.a:
        moved = [h * a * k for a, k in zip(row, stages, strict=False) if a]
        stages.append(rate(x + sum(moved) if moved else x))
    return stages


def _implicit_stages(
    rate: Rate, x: Expression, h: Expression | float, tableau: Tableau
) -> list[Expression]:
    """Newton's method on r_i(k) = k_i - rate(x + h sum_j a_ij k_j)."""
    stages, n = len(tableau.b), x.numel()
    k = ca.SX.sym("k", stages * n)
    parts = ca.vertsplit(k, n)
    residual = ca.vertcat(
        *(
            part - rate(x + h * sum(a * other for a, other in zip(row, parts, strict=True)))
            for row, part in zip(tableau.a, parts, strict=True)
        )
    )
    slope = ca.jacobian(residual, k)
    found = ca.repmat(rate(x), stages, 1)
    for _ in range(NEWTON_STEPS):
        at, around = ca.substitute([residual, slope], [k], [found])
        found = found - ca.solve(around, at)
    return ca.vertsplit(found, n)
