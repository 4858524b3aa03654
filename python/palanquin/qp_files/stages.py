"""General QPs cut into stages, by given sizes or by what their pattern tells."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from palanquin.errors import ProblemError
from palanquin.qp_files.general_qp import Array, GeneralQp
from palanquin.qp_files.ocp_qp import Knot, OcpQp

_FAR = 0.5  # of all variables, between two rows
_MOST_CONSTANTS = 5
Sizes = list[tuple[int, int]]
"""(nx, nu) of every stage."""


def from_general(qp: GeneralQp, sizes: Sequence[Sequence[int]] | None = None) -> OcpQp:
    """A general QP by stages.

    Args:
        qp: its variables in the order (x_0, u_0, x_1, ...).
        sizes: (nx, nu) of every stage. Rows x_{k+1} - F(x_k, u_k) = b are its dynamics; without
            sizes all is one stage.

    Raises:
        ProblemError: cost or rows reach over stages, or a stage has no dynamics.
    """
    if sizes is None:
        empty = np.zeros((0, qp.q.size))
        only = Knot(0, qp.q.size, qp.P, qp.q, qp.C, qp.low, qp.up, empty, np.zeros(0))
        return OcpQp(qp.name, (only,))
    return _Cut(qp, [(int(nx), int(nu)) for nx, nu in sizes]).ocp()


class _Cut:
    """Cuts a general QP into stages."""

    def __init__(self, qp: GeneralQp, sizes: list[tuple[int, int]]) -> None:
        self._qp, self._sizes = qp, sizes
        widths = [nx + nu for nx, nu in sizes]
        if sum(widths) != qp.q.size:
            raise ProblemError(
                f"{qp.name}: stages have {sum(widths)} variables, but the QP has {qp.q.size}"
            )
        self._starts = np.concatenate([[0], np.cumsum(widths)]).astype(int)
        stage_of = np.repeat(np.arange(len(sizes)), widths)
        outside = stage_of[:, None] != stage_of[None, :]
        if np.any(qp.P[outside]):
            raise ProblemError(f"{qp.name}: P couples variables of different stages")
        self._stage_of = stage_of

    def ocp(self) -> OcpQp:
        """All knots."""
        own: list[list[int]] = [[] for _ in self._sizes]
        dynamics: list[list[int]] = [[] for _ in self._sizes]
        for i, row in enumerate(self._qp.C):
            stages = np.unique(self._stage_of[np.flatnonzero(row)])
            if stages.size <= 1:
                own[stages[0] if stages.size else 0].append(i)
            elif stages.size == 2 and stages[1] == stages[0] + 1 and self._qp.is_equality[i]:
                dynamics[stages[0]].append(i)
            else:
                raise ProblemError(f"{self._qp.name}: row {i} couples stages {stages.tolist()}")
        for k in range(len(self._sizes) - 1):
            self._complete(k + 1, dynamics[k], own[k + 1])
        knots = [self._knot(k, own[k], dynamics[k]) for k in range(len(self._sizes))]
        return OcpQp(self._qp.name, tuple(knots))

    def _complete(self, k: int, dynamics: list[int], own: list[int]) -> None:
        """Where dynamics say too little of the states of stage k, equalities over these say it."""
        nx = self._sizes[k][0]
        states = slice(self._starts[k], self._starts[k] + nx)
        inputs = slice(states.stop, self._starts[k + 1])
        for i in [i for i in own if self._qp.is_equality[i] and not self._qp.C[i, inputs].any()]:
            if len(dynamics) == nx:
                return
            if np.linalg.matrix_rank(self._qp.C[[*dynamics, i], states]) > len(dynamics):
                dynamics.append(i)
                own.remove(i)

    def _knot(self, k: int, rows: list[int], dynamics: list[int]) -> Knot:
        qp, (nx, nu) = self._qp, self._sizes[k]
        own = slice(self._starts[k], self._starts[k + 1])
        F: Array = np.zeros((0, nx + nu))
        b: Array = np.zeros(0)
        if k + 1 < len(self._sizes):
            next_nx, after = self._sizes[k + 1][0], self._starts[k + 1]
            step = qp.C[dynamics, after : after + next_nx]
            inputs = qp.C[dynamics, after + next_nx : self._starts[k + 2]]
            if step.shape != (next_nx, next_nx) or np.any(inputs):
                raise ProblemError(
                    f"{qp.name}: stage {k} has {len(dynamics)} rows to the {next_nx} states of the "
                    "next; they must be its dynamics"
                )
            if abs(np.linalg.det(step)) < 1e-12:
                raise ProblemError(f"{qp.name}: dynamics of stage {k} leave next states open")
            F = np.linalg.solve(step, -qp.C[dynamics, own]).astype(float)
            b = np.linalg.solve(step, qp.low[dynamics]).astype(float)
        return Knot(
            nx, nu, qp.P[own, own], qp.q[own], qp.C[rows, own], qp.low[rows], qp.up[rows], F, b
        )


def find_stages(qp: GeneralQp) -> OcpQp:
    """By stages of equal sizes, as many as the pattern allows; by one stage if it tells of none.

    Tried are the usual orders of variables: (x_0, u_0, x_1, ...), all states before all inputs, and
    both without x_0. Variables that rows of the whole horizon are over, a final time or a parameter
    that is decided, become states that stay as they are, in front of the others: the QP by stages
    then has a copy of them at every stage.
    """
    throughout = _throughout(qp)
    if throughout.any() and (found := _cut(_without(qp, throughout))) is not None:
        with suppress(ProblemError):  # where their cost is coupled with that of other stages
            return _with_constants(qp, throughout, *found)
    found = _cut(qp)
    return from_general(qp) if found is None else from_general(found[0], found[2])


def _cut(qp: GeneralQp) -> tuple[GeneralQp, NDArray[np.int_], Sizes] | None:
    """Its variables in the order of stages, that order, and the stages' sizes."""
    n = qp.q.size
    for stages in range(n, 1, -1):
        for order, sizes in _layouts(n, stages):
            sorted_qp = _reordered(qp, order, sizes)
            if sorted_qp is None:
                continue
            try:
                from_general(sorted_qp, sizes)
            except ProblemError:
                continue
            return sorted_qp, order, sizes
    return None


def _throughout(qp: GeneralQp) -> NDArray[np.bool_]:
    """Which variables are in rows far from each other, by the middle of the variables that a row is
    over; none where they are many.
    """
    n, is_over = qp.q.size, qp.C != 0
    middle = [float(np.median(np.flatnonzero(row))) if row.any() else np.nan for row in is_over]
    spread = [np.ptp(np.array(middle)[rows]) if rows.any() else 0.0 for rows in is_over.T]
    found = np.array(spread) > _FAR * n
    return found if found.sum() <= _MOST_CONSTANTS else np.zeros_like(found)


def _without(qp: GeneralQp, left_out: NDArray[np.bool_]) -> GeneralQp:
    kept = ~left_out
    alone = ~np.any(qp.C[:, kept], axis=1)  # their own bounds
    return GeneralQp(
        qp.name, qp.P[np.ix_(kept, kept)], qp.q[kept], qp.C[~alone][:, kept], qp.low[~alone],
        qp.up[~alone],
    )  # fmt: skip


def _with_constants(
    qp: GeneralQp, constant: NDArray[np.bool_], _: GeneralQp, order: NDArray[np.int_], sizes: Sizes
) -> OcpQp:
    """`qp` with the constants in front of each stage's states; their cost is the first one's."""
    count, widths = int(constant.sum()), [nx + nu for nx, nu in sizes]
    starts = np.concatenate([[0], np.cumsum([count + width for width in widths])]).astype(int)
    stage_of = np.empty(order.size, dtype=int)
    stage_of[order] = np.repeat(np.arange(len(sizes)), widths)
    place = np.empty(order.size, dtype=int)  # of the others' variables among the new ones
    place[order] = np.concatenate(
        [start + count + np.arange(width) for start, width in zip(starts, widths, strict=False)]
    )
    others, n = np.flatnonzero(~constant), int(starts[-1])
    new = np.empty(qp.q.size, dtype=int)  # where a variable is, constants at the first stage
    new[others], new[constant] = place, np.arange(count)
    P, q = np.zeros((n, n)), np.zeros(n)
    P[np.ix_(new, new)], q[new] = qp.P, qp.q
    C = np.zeros((qp.low.size, n))
    C[:, place] = qp.C[:, others]
    for row, coefficients, rest in zip(C, qp.C[:, constant], qp.C[:, others], strict=True):
        used = np.flatnonzero(rest)
        start = starts[stage_of[used].min() if used.size else 0]
        row[start : start + count] = coefficients
    stays = np.zeros((count * (len(sizes) - 1), n))
    for k, rows in enumerate(np.split(stays, len(sizes) - 1)):
        rows[:, starts[k] : starts[k] + count] = -np.eye(count)
        rows[:, starts[k + 1] : starts[k + 1] + count] = np.eye(count)
    zero = np.zeros(len(stays))
    whole = GeneralQp(qp.name, P, q, np.vstack([stays, C]), np.r_[zero, qp.low], np.r_[zero, qp.up])
    return from_general(whole, [(count + nx, nu) for nx, nu in sizes])


def _layouts(n: int, stages: int) -> Iterator[tuple[NDArray[np.int_], Sizes]]:
    """Orders of variables by stages, with these sizes."""
    last = stages - 1
    for nx in range(1, n // last + 1):
        for with_first in (True, False):
            nu, rest = divmod(n - nx * (stages if with_first else last), last)
            if rest or nu < 1:
                continue
            sizes = [(nx if k or with_first else 0, nu if k < last else 0) for k in range(stages)]
            yield np.arange(n), sizes
            states = sum(x for x, _ in sizes)
            order: list[int] = []
            x, u = 0, states
            for size_x, size_u in sizes:
                order += [*range(x, x + size_x), *range(u, u + size_u)]
                x, u = x + size_x, u + size_u
            yield np.array(order), sizes


def _reordered(qp: GeneralQp, order: NDArray[np.int_], sizes: Sizes) -> GeneralQp | None:
    """None where cost or rows reach further than these stages let them."""
    stage_of = np.empty(qp.q.size, dtype=int)
    stage_of[order] = np.repeat(np.arange(len(sizes)), [nx + nu for nx, nu in sizes])
    i, j = np.nonzero(qp.P)
    if np.any(stage_of[i] != stage_of[j]):
        return None
    first = np.where(qp.C != 0, stage_of, len(sizes)).min(axis=1, initial=len(sizes))
    last = np.where(qp.C != 0, stage_of, -1).max(axis=1, initial=-1)
    if np.any(last - first > np.where(qp.is_equality, 1, 0)):
        return None
    P, C = qp.P[np.ix_(order, order)], qp.C[:, order]
    return GeneralQp(qp.name, P, qp.q[order], C, qp.low, qp.up)
