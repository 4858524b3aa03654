"""A QP by stages: the form of HPIPM and acados, and the engine's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palanquin import _core
from palanquin.errors import ProblemError
from palanquin.qp_files.general_qp import Array, GeneralQp


@dataclass(frozen=True)
class Knot:
    """Variables (x, u) of a stage, their cost, rows and next states.

    1/2 (x, u)'H(x, u) + g'(x, u),  low <= C(x, u) <= up,  x_next = F(x, u) + b; F [0, nx + nu] at
    the last one.
    """

    nx: int
    nu: int
    H: Array
    g: Array
    C: Array
    low: Array
    up: Array
    F: Array
    b: Array

    @property
    def size(self) -> int:
        """Number of variables nx + nu."""
        return self.nx + self.nu


@dataclass(frozen=True)
class OcpQp:
    """A QP by stages. x_0 is free as far as the first knot's rows leave it free."""

    name: str
    knots: tuple[Knot, ...]

    def __post_init__(self) -> None:
        for k, (knot, after) in enumerate(zip(self.knots, (*self.knots[1:], None), strict=True)):
            size, rows, nx = knot.size, knot.low.size, after.nx if after else 0
            shapes = {
                "H": (size, size), "g": (size,), "C": (rows, size), "up": (rows,), "F": (nx, size),
                "b": (nx,),
            }  # fmt: skip
            for field, shape in shapes.items():
                if (found := getattr(knot, field).shape) != shape:
                    raise ProblemError(
                        f"{self.name}: {field} of stage {k} is {found}, but must be {shape}"
                    )

    def general(self) -> GeneralQp:
        """Over all (x_0, u_0, x_1, ...): dynamics, then each knot's rows."""
        starts = np.concatenate([[0], np.cumsum([k.size for k in self.knots])]).astype(int)
        n = int(starts[-1])
        P, q = np.zeros((n, n)), np.zeros(n)
        C: list[Array] = []
        low: list[Array] = []
        up: list[Array] = []
        for knot, after, at in zip(self.knots, (*self.knots[1:], None), starts[:-1], strict=True):
            own = slice(at, at + knot.size)
            P[own, own], q[own] = knot.H, knot.g
            if after is not None:
                rows = np.zeros((after.nx, n))
                rows[:, own] = -knot.F
                rows[:, own.stop : own.stop + after.nx] = np.eye(after.nx)
                C, low, up = [*C, rows], [*low, knot.b], [*up, knot.b]
            rows = np.zeros((knot.low.size, n))
            rows[:, own] = knot.C
            C, low, up = [*C, rows], [*low, knot.low], [*up, knot.up]
        return GeneralQp(self.name, P, q, np.vstack(C), np.concatenate(low), np.concatenate(up))

    def measured(self) -> Array | None:
        """x_0 where rows fix each of its entries by itself; else None."""
        first = self.knots[0]
        found = np.full(first.nx, np.nan)
        for row, low, up in zip(first.C, first.low, first.up, strict=True):
            (at,) = np.nonzero(row)
            if low == up and at.size == 1 and at[0] < first.nx:
                found[at[0]] = low / row[at[0]]
        return None if np.isnan(found).any() else found


class StagedQp:
    """An OcpQp as the engine's StageQp. A free x_0 becomes inputs of the first knot."""

    def __init__(self, ocp: OcpQp) -> None:
        self._ocp = ocp
        self._x0 = ocp.measured()
        self._rows = [_Rows(knot, k == 0 and self._x0 is not None) for k, knot in
                      enumerate(ocp.knots)]  # fmt: skip
        stages = []
        for k, (knot, rows) in enumerate(zip(ocp.knots, self._rows, strict=True)):
            is_free = k == 0 and self._x0 is None
            stages.append({
                "nx": 0 if is_free else knot.nx, "nu": knot.size if is_free else knot.nu,
                "hessian": knot.H, "gradient": knot.g, "dynamics": knot.F, "offset": knot.b,
                "equality_jacobian": knot.C[rows.equal], "equality_value": -knot.low[rows.equal],
                "inequality_jacobian": np.vstack([knot.C[rows.upper], -knot.C[rows.lower]]),
                "inequality_value": np.concatenate([-knot.up[rows.upper], knot.low[rows.lower]]),
            })  # fmt: skip
        x0 = np.zeros(0) if self._x0 is None else self._x0
        self.qp = _core.StageQp.of(x0, stages)

    def point(self, solution: _core.StageQpSolution) -> tuple[Array, Array]:
        """X and y of `OcpQp.general`."""
        x = np.concatenate(solution.w)
        y: list[Array] = []
        for k, (knot, rows) in enumerate(zip(self._ocp.knots, self._rows, strict=True)):
            if k + 1 < len(self._rows):
                y.append(-solution.dynamics_multiplier[k + 1])  # of x_next - F(x, u) = b
            own = np.zeros(knot.low.size)
            own[rows.equal] = solution.equality_multiplier[k]
            hard = solution.inequality_multiplier[k]
            own[rows.upper] += hard[: rows.upper.size]
            own[rows.lower] -= hard[rows.upper.size :]
            if rows.fixing.size:
                (at,) = (np.argmax(np.abs(knot.C[rows.fixing]), axis=1),)
                scale = knot.C[rows.fixing, at]
                own[rows.fixing] = solution.dynamics_multiplier[0][at] * -1.0 / scale
            y.append(own)
        return x, np.concatenate(y)


class _Rows:
    """Indices of a knot's rows by kind; `fixing`: those that say what x_0 is."""

    def __init__(self, knot: Knot, is_measured: bool) -> None:
        low, up = knot.low, knot.up
        equal = low == up
        single = np.count_nonzero(knot.C, axis=1) == 1
        on_state = np.argmax(np.abs(knot.C), axis=1) < knot.nx if knot.size else single
        fixes = equal & single & on_state & is_measured
        self.fixing = np.flatnonzero(fixes)
        self.equal = np.flatnonzero(equal & ~fixes)
        self.upper = np.flatnonzero(~equal & np.isfinite(up))
        self.lower = np.flatnonzero(~equal & np.isfinite(low))


def from_stage_qp(qp: _core.StageQp, model: _core.PenaltyModel, name: str) -> OcpQp:
    """The engine's QP, its penalties as the quadratics of `model`. Locals become inputs.

    Raises ProblemError for rows over two knots.
    """
    knots = []
    for k in range(qp.horizon + 1):
        stage = qp.stage(k)
        if stage.link_value.size:
            raise ProblemError(f"{name}: knot {k} has rows over two knots; use form='reduced'")
        J = stage.penalty_jacobian.reshape(-1, stage.nw)
        H = stage.hessian + J.T @ (model.curvature[k][:, None] * J)
        g = stage.gradient + J.T @ model.slope[k]
        inverse = np.linalg.inv(
            np.eye(stage.offset.size) - _rows(stage.implicit, stage.offset.size)
        )
        equal = _rows(stage.equality_jacobian, stage.nw)
        hard = _rows(stage.inequality_jacobian, stage.nw)
        rows: list[Any] = [equal, hard]
        low = [-stage.equality_value, np.full(stage.inequality_value.size, -np.inf)]
        up = [-stage.equality_value, -stage.inequality_value]
        if k == 0:
            rows.append(np.eye(stage.nx, stage.nw))
            low.append(qp.initial_state)
            up.append(qp.initial_state)
        F = inverse @ _rows(stage.dynamics, stage.nw)
        knots.append(
            Knot(
                stage.nx,
                stage.nw - stage.nx,
                H,
                g,
                np.vstack(rows),
                np.concatenate(low),
                np.concatenate(up),
                F,
                inverse @ stage.offset,
            )
        )
    return OcpQp(name, tuple(knots))


def _rows(matrix: NDArray[np.float64], columns: int) -> Array:
    return matrix.reshape(-1, columns) if matrix.size else np.zeros((matrix.shape[0], columns))
