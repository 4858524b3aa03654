"""Second derivatives in the tangent space: exact Hessians of the Lagrangian, and a cost's terms."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from palanquin.checking.code import EQUALITY, INEQUALITY, Array, CompiledProblem, Point
from palanquin.checking.differences import TOLERANCE, Derivative, differences
from palanquin.checking.report import Finding
from palanquin.lowering import exact_tangent_hessian, knot_symbols
from palanquin.problem import Problem
from palanquin.terms import CostTerm

# ---- exact Hessians ------------------------------------------------------------------------------


def exact_hessians(code: CompiledProblem, at: Point) -> Iterator[Derivative]:
    """Hessians of the Lagrangian against differences of its gradient.

    Where blocks are on charts, along the charts: with z(y) the embedding and S its slope, the
    Hessian of L(z(y)) is S' H S with the charts' own curvature in H.
    """
    charted = code.charted(at.roles)
    z = _embedded(code, at, charted)
    for stage in ("running", "terminal"):
        flags = charted if stage == "running" else np.zeros_like(charted)
        rows = [code.row_names(stage, kind) for kind in (EQUALITY, INEQUALITY)]
        sizes = [len(code.dynamics) if stage == "running" else 0, *map(len, rows)]
        multipliers = [np.cos(np.arange(n) + 1.0 + i) for i, n in enumerate(sizes)]
        slope, names = _slope(code, z, at.p, flags)

        def gradient(
            dy: Array, stage: str = stage, flags: Array = flags, slope: Array = slope,
            multipliers: list[Array] = multipliers,
        ) -> Array:  # fmt: skip
            moved = _on_charts(code, code.moved(z, slope @ dy), at.p, flags)
            own = _slope(code, moved, at.p, flags)[0]
            return own.T @ _lagrangian_gradient(code, stage, moved, at, multipliers)

        if stage == "running":
            (lower,) = code("exact_running", z, at.p, charted, *multipliers)
        else:
            (lower,) = code("exact_terminal", z, at.p, *multipliers[1:])
        full = lower + np.tril(lower, -1).T
        names_of_rows = [f"Lagrangian's gradient by {n}" for n in names]
        yield Derivative(
            f"exact_{stage}", names_of_rows, names, gradient, slope.T @ full @ slope, True
        )


def _embedded(code: CompiledProblem, at: Point, charted: Array) -> Array:
    return _on_charts(code, at.z, at.p, charted)


def _on_charts(code: CompiledProblem, z: Array, p: Array, charted: Array) -> Array:
    if not charted.any():
        return z
    moved, on_charts = z.copy(), code("chart", z, p)[0].ravel()
    for b, is_on in zip(code.blocks, charted, strict=True):
        if is_on:
            own = slice(b.offset, b.offset + b.size)
            moved[own] = on_charts[own]
    return moved


def _slope(code: CompiledProblem, z: Array, p: Array, charted: Array) -> tuple[Array, list[str]]:
    """d(dz)/d(dy) [ndz, ndy], where charted blocks move by their coordinates; names of dy."""
    slopes = code("chart", z, p)[1].ravel() if charted.any() else np.zeros(0)
    columns, names = [], []
    for b, is_on in zip(code.blocks, charted, strict=True):
        free = b.chart_size if is_on else b.tangent_size
        part = np.zeros((code.core.ndz, free))
        own = slice(b.tangent_offset, b.tangent_offset + b.tangent_size)
        part[own] = np.eye(b.tangent_size)[:, :free]
        if is_on:
            entries = slopes[b.slope_offset : b.slope_offset + b.size * free]
            part[own] = entries.reshape(free, b.size).T
        columns.append(part)
        names += code.columns[own][:free]
    return np.hstack(columns), names


def _lagrangian_gradient(
    code: CompiledProblem, stage: str, z: Array, at: Point, multipliers: list[Array]
) -> Array:
    """Of cost + lambda_d' d(z) + lambda_g' g + lambda_h' h, with explicit dynamics d(z)."""
    of_d, of_g, of_h = multipliers
    if stage == "terminal":
        _, _, _, gradient, _, by_z_equality, by_z_inequality = code("terminal_linear", z, at.p)
        return gradient.ravel() + of_g @ by_z_equality + of_h @ by_z_inequality
    results = code("running_linear", z, _explicit_next(code, z, at), at.p)
    _, _, _, _, by_z, by_next, gradient, _, by_z_equality, by_z_inequality = results
    explicit = np.linalg.solve(np.eye(len(of_d)) - by_next, by_z)
    return gradient.ravel() + of_d @ explicit + of_g @ by_z_equality + of_h @ by_z_inequality


def _explicit_next(code: CompiledProblem, z: Array, at: Point) -> Array:
    """The knot z+ whose states are the dynamics' own. No state depends on its own next value, so
    that at most as many substitutions as there are states end it.
    """
    z_next = at.z_next.copy()
    for _ in code.states:
        before = z_next.copy()
        d, offset = code("running", z, z_next, at.p)[0].ravel(), 0
        for b in code.states:
            z_next[b.offset : b.offset + b.size] = d[offset : offset + b.size]
            offset += b.size
        if np.array_equal(z_next, before):
            break
    return z_next


# ---- terms of a cost -----------------------------------------------------------------------------


@dataclass
class Terms:
    """The costs that a problem states at a stage, each with derivatives in the tangent space.

    Interpreted by CasADi: so a fault of the whole cost has a term's name.
    """

    code: CompiledProblem
    problem: Problem
    stage: str

    def __post_init__(self) -> None:
        knot = knot_symbols(self.problem)
        arguments = [knot.z, knot.p]
        self._functions: dict[str, ca.Function] = {}
        self._support = {term.name: self._columns_of(term) for term in self._terms()}
        for term in self._terms():
            if term.weight is None:
                gradient, hessian = exact_tangent_hessian(self.problem, knot, term.expression)
                results = [term.expression, gradient.T, hessian]
            else:
                slope = ca.jacobian(term.expression, knot.z) @ knot.tangent
                results = [term.expression, slope, term.weight]
            results = [ca.densify(r) for r in results]
            self._functions[term.name] = ca.Function("term", arguments, results)

    def _terms(self) -> list[CostTerm]:
        return [t for t in self.problem.costs if t.at in (self.stage, "all")]

    def _columns_of(self, term: CostTerm) -> NDArray[np.intp]:
        """Entries of dz that a term mentions; it is constant along the others."""
        symbols = {s.name() for s in ca.symvar(term.expression)}
        columns: list[int] = []
        for stated, b in zip(self.problem.blocks, self.code.blocks, strict=True):
            own = range(b.tangent_offset, b.tangent_offset + b.tangent_size)
            is_used = [s.name() in symbols for s in ca.vertsplit(stated.symbol)]
            if b.is_quaternion:
                columns += own if any(is_used) else []
            else:
                columns += [i for i, used in zip(own, is_used, strict=True) if used]
        return np.array(columns, dtype=np.intp)

    def _moved(self, term: CostTerm, at: Point, dy: Array) -> Array:
        """The knot after a step along the columns that a term mentions."""
        dz = np.zeros(self.code.core.ndz)
        dz[self._support[term.name]] = dy
        return self.code.moved(at.z, dz)

    def _call(self, term: CostTerm, z: Array, p: Array) -> list[Array]:
        return [np.array(r) for r in self._functions[term.name].call([ca.DM(z), ca.DM(p)])]

    def derivatives(self, at: Point) -> Iterator[Derivative]:
        """Jacobians of the residuals, gradients and Hessians of general costs."""
        for term in self._terms():
            value, slope, hessian = self._call(term, at.z, at.p)

            def values(dz: Array, term: CostTerm = term) -> Array:
                return self._call(term, self._moved(term, at, dz), at.p)[0].ravel()

            def gradient(dz: Array, term: CostTerm = term) -> Array:
                slope = self._call(term, self._moved(term, at, dz), at.p)[1]
                return slope.ravel()[self._support[term.name]]

            what = "cost" if term.weight is None else "residual"
            rows = [f"{what} '{term.name}'"]
            if value.size > 1:
                rows = [f"{what} '{term.name}' (row {i})" for i in range(value.size)]
            own = self._support[term.name]
            columns = [self.code.columns[i] for i in own]
            yield Derivative(self.stage, rows, columns, values, slope[:, own])
            if term.weight is None and np.isfinite(slope).all():
                names = [f"gradient of cost '{term.name}' by {c}" for c in columns]
                yield Derivative(
                    self.stage, names, columns, gradient, hessian[np.ix_(own, own)], True
                )

    def hessian(self, at: Point) -> tuple[Array, Array]:
        """The cost's Hessian [ndz, ndz] by finite differences, 2 J'WJ for residuals, and a bound on
        its error.
        """
        size = self.code.core.ndz
        total, error = np.zeros((size, size)), np.zeros((size, size))
        for term in self._terms():
            is_residual = term.weight is not None
            index = 0 if is_residual else 1

            own = self._support[term.name]
            entries = np.ix_(own, own)

            def values(dz: Array, term: CostTerm = term, index: int = index) -> Array:
                found = self._call(term, self._moved(term, at, dz), at.p)[index].ravel()
                return found[self._support[term.name]] if index else found

            found = differences(values, len(own))
            if is_residual:
                weighted = 2 * self._call(term, at.z, at.p)[2] * found.slope
                total[entries] += found.slope.T @ weighted
                error[entries] += 2 * found.uncertainty.T @ np.abs(weighted)
            else:
                total[entries] += (found.slope + found.slope.T) / 2
                error[entries] += found.uncertainty + found.uncertainty.T
        return total, error

    def negative(self, at: Point) -> list[str]:
        """Names of the terms whose own Hessian has negative curvature."""
        names = []
        for term in self._terms():
            _, _, last = self._call(term, at.z, at.p)
            least = last.min() if term.weight is not None else _least_curvature(last)
            if least < 0:
                names.append(f"'{term.name}'")
        return names


def _least_curvature(hessian: Array) -> float:
    if not np.isfinite(hessian).all():
        return 0.0
    values = np.linalg.eigvalsh(hessian)
    return float(values[0]) if values[0] < -1e-9 * np.abs(values).max() else 0.0


def hessian_faults(terms: Terms, stated: Array, at: Point) -> Iterator[Finding]:
    """Entries of a cost's Hessian [ndz, ndz] as it was lowered that differ from its terms'."""
    expected, error = terms.hessian(at)
    if not (np.isfinite(expected).all() and np.isfinite(stated).all()):
        return  # the terms' first derivatives are not finite, which is told of them
    allowed = TOLERANCE * np.abs(expected).max(axis=1, initial=0)[:, None] + 10 * error + 1e-7
    names = terms.code.columns
    for i, j in np.argwhere(np.tril(np.abs(stated - expected) > allowed)):
        text = f"it is lowered as {stated[i, j]:.6g}, its terms give {expected[i, j]:.6g}"
        row = f"cost's Hessian in {names[i]}"
        yield Finding("derivative", terms.stage, row, names[j], at.label, text)
