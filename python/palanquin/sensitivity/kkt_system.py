"""The KKT system of a plan, factorised once, and its right-hand sides."""

from __future__ import annotations

from collections.abc import Iterable

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from palanquin.errors import ProblemError
from palanquin.sensitivity.program import Program

Array = NDArray[np.float64]

STEP = 1e-3
"""Of differences by a parameter, relative to it or to 1."""
FOURTH_ORDER = ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12))
"""Places in steps, and weights, of the first derivative."""


class KktSystem:
    """[H C'; C 0] over the free variables of a program, and what it is multiplied by."""

    def __init__(self, program: Program) -> None:
        self._program = program
        knots = range(program.horizon + 1)
        self._knots = [program.at(k, program.p[k]) for k in knots]
        sizes = [len(at.values) for at in self._knots]
        self._row = np.concatenate([[0], np.cumsum(sizes)])
        self._free = np.flatnonzero(program.is_free)
        self._slope = self._rows()
        self._multipliers = self._find_multipliers()
        self._hessian = self._second_derivatives()
        self._solve = _factorised(
            self._hessian[np.ix_(self._free, self._free)], self._slope[:, self._free]
        )

    # ---- the system ------------------------------------------------------------------------------

    def _columns(self, k: int) -> slice:
        nz = self._program.nz
        return slice((k + 1) * nz, (k + 2) * nz)

    def _rows(self) -> Array:
        """C over all entries of z_{-1} .. z_N."""
        program = self._program
        slope = np.zeros((self._row[-1], len(program.is_free)))
        for k, at in enumerate(self._knots):
            first, last = self._row[k], self._row[k + 1]
            slope[first:last, self._columns(k)] = at.slope
            slope[last - len(at.link_slope) : last, self._columns(k - 1)] += at.link_slope
            if k < program.horizon:
                following = self._columns(k + 1).start + program.states
                slope[first + np.arange(len(following)), following] -= program.side(k)
        return slope

    def _find_multipliers(self) -> Array:
        """Those with which the Lagrangian's gradient is smallest."""
        gradient = np.zeros(len(self._program.is_free))
        for k, at in enumerate(self._knots):
            gradient[self._columns(k)] += at.gradient
        own = self._slope[:, self._free]
        solve = _factorised(np.eye(len(self._free)), own)
        return solve(gradient[self._free][:, None], np.zeros((len(own), 1)))[len(self._free) :, 0]

    def _second_derivatives(self) -> Array:
        n = len(self._program.is_free)
        hessian = np.zeros((n, n))
        for k, at in enumerate(self._knots):
            own, link = self._program.hessian(k, self._of(k), at)
            hessian[self._columns(k), self._columns(k)] += own
            both = slice(self._columns(k - 1).start, self._columns(k).stop)
            hessian[both, both] += link
        return hessian

    def _of(self, k: int) -> Array:
        return self._multipliers[self._row[k] : self._row[k + 1]]

    # ---- right-hand sides ------------------------------------------------------------------------

    def by_measured(self, directions: Array) -> Array:
        """Changes of z_0 .. z_N, stacked, along `directions` [nz, m] of the measured knot."""
        program = self._program
        given = np.zeros((len(program.is_free), directions.shape[1]))
        given[self._columns(-1)] = directions
        known = np.intersect1d(program.states, np.flatnonzero(~program.is_free[self._columns(0)]))
        given[self._columns(0).start + known] = directions[known]
        change = self._solve((self._hessian @ given)[self._free], self._slope @ given)
        return self._all(change, given)

    def by_parameters(self, columns: NDArray[np.intp], knots: Iterable[int]) -> Array:
        """Changes of z_0 .. z_N, stacked, with entries of p that change at some knots alike."""
        n, m = len(self._program.is_free), len(self._row) and self._row[-1]
        gradient, values = np.zeros((n, len(columns))), np.zeros((m, len(columns)))
        for k in knots:
            for j, column in enumerate(columns):
                own, before, rows = self._by_parameter(k, int(column))
                gradient[self._columns(k), j] += own
                gradient[self._columns(k - 1), j] += before
                values[self._row[k] : self._row[k + 1], j] += rows
        return self._all(self._solve(gradient[self._free], values), np.zeros_like(gradient))

    def _by_parameter(self, k: int, column: int) -> tuple[Array, Array, Array]:
        """Change of the Lagrangian's gradient by z_k and by z_{k-1}, and of the rows."""
        program, y = self._program, self._of(k)
        total = [np.zeros(program.nz), np.zeros(program.nz), np.zeros(len(y))]
        step = STEP * max(1.0, abs(program.p[k, column]))
        for place, weight in FOURTH_ORDER:
            p = program.p[k].copy()
            p[column] += place * step
            at = program.at(k, p)
            links = len(at.link_slope)
            before = y[len(y) - links :] @ at.link_slope if links else np.zeros(program.nz)
            parts = (at.gradient + y @ at.slope, before, at.values)
            for sum_, part in zip(total, parts, strict=True):
                sum_ += weight / step * part
        return total[0], total[1], total[2]

    def _all(self, change: Array, given: Array) -> Array:
        """With the entries that are known, without those of z_{-1}."""
        full = given.copy()
        full[self._free] = change[: len(self._free)]
        return full[self._program.nz :]


class _factorised:  # noqa: N801  (used as a function)
    """Solves [H C'; C 0] x = -(a, b)."""

    def __init__(self, hessian: Array, slope: Array) -> None:
        n, m = len(hessian), len(slope)
        matrix = np.zeros((n + m, n + m))
        matrix[:n, :n], matrix[:n, n:], matrix[n:, :n] = hessian, slope.T, slope
        self._dense = matrix
        rows, columns = np.nonzero(matrix)
        values = matrix[rows, columns]
        self._matrix = ca.DM.triplet(rows.tolist(), columns.tolist(), ca.DM(values), n + m, n + m)
        self._solver = ca.Linsol("kkt", "qr", self._matrix.sparsity())
        self._solver.sfact(self._matrix)
        self._solver.nfact(self._matrix)

    def __call__(self, a: Array, b: Array) -> Array:
        right = -np.vstack([a, b])
        found = self._apply(right)
        found = found + self._apply(right - self._dense @ found)  # one refinement
        scale = max(1.0, np.abs(right).max(initial=0.0))
        if not np.abs(self._dense @ found - right).max(initial=0.0) <= 1e-6 * scale:
            raise ProblemError(
                "the plan has no derivatives: its KKT system is singular (rows that depend on each "
                "other, or a variable that nothing settles)"
            )
        return found

    def _apply(self, right: Array) -> Array:
        return np.array(self._solver.solve(self._matrix, ca.DM(right)))
