"""First derivatives of every lowered function, each with the values that it derives."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from palanquin.checking.code import EQUALITY, INEQUALITY, LINK, Array, CompiledProblem, Point
from palanquin.checking.differences import Derivative


def sqp_derivatives(code: CompiledProblem, at: Point) -> Iterator[Derivative]:
    """Those that the SQP uses: in the tangent space, and the charts' slopes."""
    yield from _running(code, at)
    yield _terminal(code, at)
    if code.row_names("running", LINK):
        yield from _link(code, at)
    yield from _charts(code, at)


def _running(code: CompiledProblem, at: Point) -> Iterator[Derivative]:
    results = code("running_linear", at.z, at.z_next, at.p)
    d, _, _, _, by_z, by_next, gradient, _, by_z_equality, by_z_inequality = results
    base = d.ravel()

    def values(dz: Array) -> Array:
        d, *others = code("running", code.moved(at.z, dz), at.z_next, at.p)
        return np.concatenate([code.state_difference(d.ravel(), base), *map(np.ravel, others)])

    def dynamics(dz: Array) -> Array:
        step = np.zeros(code.core.ndz)
        step[code.state_columns] = dz
        moved = code("running", at.z, code.moved(at.z_next, step), at.p)[0].ravel()
        return code.state_difference(moved, base)

    rows = [
        *code.dynamics,
        "cost",
        *code.row_names("running", EQUALITY),
        *code.row_names("running", INEQUALITY),
    ]
    stated = np.vstack([by_z, gradient.T, by_z_equality, by_z_inequality])
    yield Derivative("running", rows, code.columns, values, stated)
    following = [
        f"next {name}" for name, s in zip(code.columns, code.state_columns, strict=True) if s
    ]
    yield Derivative("running", code.dynamics, following, dynamics, by_next)


def _terminal(code: CompiledProblem, at: Point) -> Derivative:
    _, _, _, gradient, _, by_z_equality, by_z_inequality = code("terminal_linear", at.z, at.p)

    def values(dz: Array) -> Array:
        return np.concatenate([r.ravel() for r in code("terminal", code.moved(at.z, dz), at.p)])

    rows = ["cost", *code.row_names("terminal", EQUALITY), *code.row_names("terminal", INEQUALITY)]
    stated = np.vstack([gradient.T, by_z_equality, by_z_inequality])
    return Derivative("terminal", rows, code.columns, values, stated)


def _link(code: CompiledProblem, at: Point) -> Iterator[Derivative]:
    _, by_previous, by_own = code("link_linear", at.z_previous, at.z, at.p)
    rows = code.row_names("running", LINK)

    def of_previous(dz: Array) -> Array:
        return code("link", code.moved(at.z_previous, dz), at.z, at.p)[0].ravel()

    def of_own(dz: Array) -> Array:
        return code("link", at.z_previous, code.moved(at.z, dz), at.p)[0].ravel()

    previous = [f"previous {name}" for name in code.columns]
    yield Derivative("link", rows, previous, of_previous, by_previous)
    yield Derivative("link", rows, code.columns, of_own, by_own)


def _charts(code: CompiledProblem, at: Point) -> Iterator[Derivative]:
    slopes = code("chart", at.z, at.p)[1].ravel()
    for b in code.blocks:
        if b.chart_size:
            own = slice(b.offset, b.offset + b.size)

            def embedded(dy: Array, own: slice = own) -> Array:
                z = at.z.copy()
                z[own][: dy.size] += dy
                return code("chart", z, at.p)[0].ravel()[own]

            names = [f"{b.name}[{i}]" for i in range(b.size)]
            rows = [f"chart of {name}" for name in names]
            slope = slopes[b.slope_offset : b.slope_offset + b.size * b.chart_size]
            stated = slope.reshape(b.chart_size, b.size).T
            yield Derivative("chart", rows, names[: b.chart_size], embedded, stated)


def nlp_derivatives(code: CompiledProblem, at: Point) -> Iterator[Derivative]:
    """Those that Ipopt uses: ambient Jacobians, and Hessians against the Jacobians' differences."""
    names = code.ambient_columns
    next_states = [f"dynamics of {b.name}[{i}]" for b in code.states for i in range(b.size)]
    for stage, dynamics in (("running", next_states), ("terminal", [])):
        equality, inequality = code.row_names(stage, EQUALITY), code.row_names(stage, INEQUALITY)
        rows = [*dynamics, "cost", *equality, *inequality]
        yield from _ambient(
            code, f"nlp_{stage}", [at.z, at.p], rows, names,
            multiplied=[["cost"], dynamics, equality, inequality] if dynamics
            else [["cost"], equality, inequality],
        )  # fmt: skip
    links = code.row_names("running", LINK)
    if links:
        both = [*(f"previous {name}" for name in names), *names]
        yield from _ambient(
            code, "nlp_link", [at.z_previous, at.z, at.p], links, both, multiplied=[links]
        )


def _ambient(
    code: CompiledProblem,
    name: str,
    arguments: list[Array],
    rows: list[str],
    columns: list[str],
    multiplied: list[list[str]],
) -> Iterator[Derivative]:
    """Of a function of stacked knots and parameters whose results are values, then Jacobians."""
    *knots, p = arguments
    at = np.concatenate(knots)
    cuts = np.cumsum([z.size for z in knots])[:-1]

    def call(z: Array, suffix: str = "", *more: Array) -> list[Array]:
        return code(name + suffix, *np.split(z, cuts), p, *more)

    is_link = len(knots) > 1
    values = 1 if is_link else len(call(at)) // 2

    def jacobian(z: Array) -> Array:
        results = call(z)[values:]
        return np.hstack(results) if is_link else np.vstack(results)

    def value(dz: Array) -> Array:
        return np.concatenate([r.ravel() for r in call(at + dz)[:values]])

    yield Derivative(name, rows, columns, value, jacobian(at))
    # One multiplier per row, fixed and different, so that no two rows can hide each other.
    weight = dict(zip(rows, np.cos(np.arange(len(rows))) + 1.5, strict=True))
    weights = np.array([weight[r] for r in rows])

    def gradient(dz: Array) -> Array:
        return weights @ jacobian(at + dz)

    multipliers = [np.array([weight[r] for r in group]) for group in multiplied]
    (lower,) = call(at, "_hessian", *multipliers)
    full = lower + np.tril(lower, -1).T
    hessian_rows = [f"Lagrangian's gradient by {c}" for c in columns]
    yield Derivative(f"{name}_hessian", hessian_rows, columns, gradient, full)
