"""The QP of an SQP step as matrices that other solvers take.

Both forms are min 1/2 x'Hx + g'x s.t. A x = b, with every penalty as its quadratic at the iterate.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from palanquin import _core

Array = np.ndarray


@dataclass(frozen=True)
class EqualityQp:
    """min 1/2 x'Hx + g'x s.t. A x = b; `nx`, `nu`, `ng` as `casadi.conic` wants them for stages."""

    H: ca.DM
    g: Array
    A: ca.DM
    b: Array
    nx: list[int]
    nu: list[int]
    ng: list[int]

    def cost(self, x: Array) -> float:
        """Objective at x."""
        return float(0.5 * x @ np.asarray(self.H @ x).ravel() + self.g @ x)

    def residual(self, x: Array) -> float:
        """Largest entry of |A x - b|."""
        return float(np.abs(np.asarray(self.A @ x).ravel() - self.b).max())


def equality_qp(qp: _core.StageQp, model: _core.PenaltyModel) -> EqualityQp:
    """Variables in the order u_0, x_1, u_1, .. and rows [dynamics to k + 1, then the knot's own].

    x_0, which is known, is substituted. Dynamics are x_{k+1} = (I - N)^{-1} (F w + b). Rows over
    two knots (the paper's form has them) count among the second knot's own, and no stage-wise
    solver takes them.
    """
    stages = [qp.stage(k) for k in range(qp.horizon + 1)]
    known = stages[0].nx
    first = np.cumsum([0, *(s.nw for s in stages)])
    hessian, gradient, ng = [], [], []
    rows: list[tuple[int, Array, Array]] = []  # (first column, matrix, right side)
    for k, stage in enumerate(stages):
        J = stage.penalty_jacobian
        hessian.append(stage.hessian + J.T @ (model.curvature[k][:, None] * J))
        gradient.append(stage.gradient + J.T @ model.slope[k])
        if k < qp.horizon:
            rows.append((first[k], *_dynamics(stage, stages[k + 1].nx)))
        own = [(first[k], stage.equality_jacobian, -stage.equality_value)]
        if len(stage.link_value):
            link = np.hstack([stage.link_previous, stage.link_jacobian])
            own.append((first[k - 1], link, -stage.link_value))
        rows += own
        ng.append(sum(len(right) for _, _, right in own))
    H = ca.diagcat(*(ca.sparsify(ca.DM(h)) for h in hessian))
    A = _stacked(rows, int(first[-1]))
    x_0 = qp.initial_state
    return EqualityQp(
        H=H[known:, known:],
        g=np.concatenate(gradient)[known:] + np.asarray(H[known:, :known] @ x_0).ravel(),
        A=A[:, known:],
        b=np.concatenate([r for _, _, r in rows]) - np.asarray(A[:, :known] @ x_0).ravel(),
        nx=[0, *(s.nx for s in stages[1:])],
        nu=[s.nu + s.nl for s in stages],
        ng=ng,
    )


def _dynamics(stage: _core.QpStage, nx_next: int) -> tuple[Array, Array]:
    """[(I - N)^{-1} F, -I] over (w_k, x_{k+1}), and -(I - N)^{-1} b."""
    data = np.column_stack([stage.dynamics, stage.offset])
    explicit = np.linalg.solve(np.eye(nx_next) - stage.implicit, data)
    return np.hstack([explicit[:, :-1], -np.eye(nx_next)]), -explicit[:, -1]


def _stacked(rows: list[tuple[int, Array, Array]], columns: int) -> ca.DM:
    blocks = []
    for first, matrix, _ in rows:
        if not len(matrix):
            continue
        sparse = ca.sparsify(ca.DM(matrix))
        right = columns - first - matrix.shape[1]
        blocks.append(
            ca.horzcat(ca.DM(matrix.shape[0], first), sparse, ca.DM(matrix.shape[0], right))
        )
    return ca.vertcat(*blocks)
