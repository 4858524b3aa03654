"""How far a trajectory is from a KKT point of the stated program."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from palanquin.benchmarks.suites.stated_program import Expansion

ACTIVE = 1e-5  # hard rows closer to zero than this may push
HELD = 1e-6  # rows violated by less hold


@dataclass(frozen=True)
class KktError:
    """Of an expansion's KKT conditions.

    Attributes:
        stationarity: largest entry of the Lagrangian's gradient under the best multipliers,
            relative to the largest of the cost's gradient or to 1.
        equality: largest residual of an equality.
        inequality: largest violation of a hard row.
    """

    stationarity: float
    equality: float
    inequality: float


def kkt_error(at: Expansion) -> KktError:
    """Under the best multipliers, those of least squares, non-negative for active hard rows.

    min |r|^2 s.t. r = grad f + C' lambda + H' nu, nu >= 0.
    """
    active = at.inequalities >= -ACTIVE
    slopes = np.vstack([at.equality_jacobian, at.inequality_jacobian[active]])
    rest = _least_residual(at.gradient, slopes, len(at.equalities))
    return KktError(
        stationarity=float(np.abs(rest).max(initial=0) / max(1.0, np.abs(at.gradient).max())),
        equality=float(np.abs(at.equalities).max(initial=0)),
        inequality=float(at.inequalities.max(initial=0)),
    )


def violation_slope(at: Expansion) -> float | None:
    """How steeply the squared violation can still be lowered, relative to the violation.

    Rows that hold must go on to hold: r = C_v' c_v + H_v' h_v + C_s' lambda + H_s' nu for violated
    rows v, satisfied ones s and nu >= 0. A point where r vanishes is stationary for the violation,
    which is what "infeasible" can mean at best; without violation there is no slope.
    """
    violated = np.abs(at.equalities) > HELD
    outside = at.inequalities > HELD
    active = ~outside & (at.inequalities >= -ACTIVE)
    pull = at.equalities[violated] @ at.equality_jacobian[violated]
    pull = pull + at.inequalities[outside] @ at.inequality_jacobian[outside]
    size = np.hypot(
        np.linalg.norm(at.equalities[violated]), np.linalg.norm(at.inequalities[outside])
    )
    if size == 0:
        return None
    held = at.equality_jacobian[~violated]
    slopes = np.vstack([held, at.inequality_jacobian[active]])
    rest = _least_residual(pull / size, slopes, len(held))
    return float(np.abs(rest).max(initial=0))


def _least_residual(gradient: np.ndarray, slopes: np.ndarray, free: int) -> np.ndarray:
    """R of the least-squares problem; the first `free` multipliers have any sign."""
    n, m = len(gradient), len(slopes)
    if m == 0:
        return gradient
    A = ca.sparsify(ca.horzcat(ca.DM.eye(n), ca.DM(-slopes.T)))
    H = ca.diagcat(ca.DM.eye(n), ca.DM(m, m))
    H = H + 1e-14 * ca.DM.eye(n + m)
    options: dict[str, Any] = {"error_on_fail": False, "print_time": False, "piqp": OPTIONS}
    pattern = {"h": H.sparsity(), "a": A.sparsity()}
    solver = ca.conic("multipliers", "piqp", pattern, options)
    lower = np.concatenate([np.full(n + free, -np.inf), np.zeros(m - free)])
    answer = solver(h=H, g=np.zeros(n + m), a=A, lba=gradient, uba=gradient, lbx=lower)
    multipliers = np.array(answer["x"]).ravel()[n:]
    multipliers[free:] = np.maximum(multipliers[free:], 0)
    return gradient + slopes.T @ multipliers


OPTIONS = {"eps_abs": 1e-12, "eps_rel": 1e-12, "max_iter": 500, "verbose": False}
