"""Functions that the SQP calls: values, derivatives, roles and charts of one knot."""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca

from palanquin.errors import ProblemError
from palanquin.lowering.dynamics import elimination_order, next_state, state_jacobians
from palanquin.lowering.knot import Knot, function, knot_symbols, pruned
from palanquin.lowering.role_rows import embedded
from palanquin.lowering.stage import (
    ROW_ORDER,
    cost_derivatives,
    groups_at,
    row_jacobians,
    stacked_rows,
    stage_values,
)
from palanquin.problem import Problem
from palanquin.terms import Block, Expression


def value_functions(problem: Problem) -> list[ca.Function]:
    """Functions without derivatives; together with the manifest they identify a problem."""
    k = knot_symbols(problem)
    functions = [_structure(problem, k), _chart(problem, k)]
    _check_neighbours(problem)
    d = next_state(problem)
    functions.append(
        function(problem, "running", [k.z, k.z_next, k.p], [d, *stage_values(problem, "running")])
    )
    _check_terminal(problem)
    functions.append(function(problem, "terminal", [k.z, k.p], stage_values(problem, "terminal")))
    link = stacked_rows(problem, "link", "running")
    functions.append(function(problem, "link", [k.z_previous, k.z, k.p], [link]))
    return functions


def sqp_functions(problem: Problem) -> list[ca.Function]:
    """Everything that the SQP needs: values, and derivatives in the tangent space."""
    k = knot_symbols(problem)
    elimination_order(problem, [b for b in problem.blocks if b.is_state])
    dd_dz, dd_dnext = state_jacobians(problem, k)
    gradient, hessian = cost_derivatives(problem, k, "running")
    running = [
        next_state(problem),
        *stage_values(problem, "running"),
        dd_dz,
        dd_dnext,
        gradient,
        hessian,
        *row_jacobians(problem, k, "running"),
    ]
    gradient, hessian = cost_derivatives(problem, k, "terminal")
    terminal = [
        *stage_values(problem, "terminal"),
        gradient,
        hessian,
        *row_jacobians(problem, k, "terminal"),
    ]
    link = stacked_rows(problem, "link", "running")
    link_jacobians = [
        link,
        pruned(ca.jacobian(link, k.z_previous) @ k.tangent_previous),
        pruned(ca.jacobian(link, k.z) @ k.tangent),
    ]
    return [
        *value_functions(problem),
        function(problem, "running_linear", [k.z, k.z_next, k.p], running),
        function(problem, "terminal_linear", [k.z, k.p], terminal),
        function(problem, "link_linear", [k.z_previous, k.z, k.p], link_jacobians),
    ]


def _structure(problem: Problem, k: Knot) -> ca.Function:
    roles = ca.vertcat(*(b.role for b in problem.blocks))
    charts = ca.vertcat(*(ca.SX(b.chart.active) if b.chart else ca.SX(0) for b in problem.blocks))
    flags = [
        ca.vertcat(*(r.active for r in groups_at(problem, kind, at)), ca.SX(0, 1))
        for kind, at in ROW_ORDER
    ]
    return function(problem, "structure", [k.p], [roles, charts, *flags])


def _chart(problem: Problem, k: Knot) -> ca.Function:
    """The knot z with charted blocks embedded; per charted block its [size, coordinates] slope."""
    values, slopes = [], []
    for b in problem.blocks:
        if b.chart is None:
            values.append(b.symbol)
            continue
        y = ca.SX.sym("y", b.chart.coordinates)
        value = embedded(b, y)
        if ca.depends_on(value, k.z):
            raise ProblemError(
                f"chart of block '{b.name}' depends on variables; it may use its coordinates and "
                "parameters"
            )
        slope = ca.densify(ca.jacobian(value, y))
        at = b.symbol[: b.chart.coordinates]
        values.append(ca.substitute(value, y, at))
        slopes.append(ca.vec(ca.substitute(slope, y, at)))
    return function(
        problem, "chart", [k.z, k.p], [ca.vertcat(*values), ca.vertcat(*slopes, ca.SX(0, 1))]
    )


def _check_neighbours(problem: Problem) -> None:
    """Costs and rows are differentiated by their own knot alone: next values belong to dynamics,
    previous ones to link rows.
    """
    terms = [(t.name, t.expression) for t in problem.costs]
    terms += [(t.name, t.weight) for t in problem.costs if t.weight is not None]
    rows = [(r.name, r.expression) for r in problem.rows if r.kind != "link"]
    links = [(r.name, r.expression) for r in problem.rows if r.kind == "link"]
    dynamics = [
        (f"dynamics of {b.name}", problem.dynamics_of(b).expression)
        for b in problem.blocks
        if b.is_state
    ]
    for name, block in _users(terms + rows + links, problem.blocks, "next_symbol"):
        raise ProblemError(
            f"'{name}' uses next('{block.name}'), which only dynamics may use; state a "
            "link row, or the cost of the next knot"
        )
    for name, block in _users(terms + rows + dynamics, problem.blocks, "previous_symbol"):
        states = (
            "" if block.is_state else f", or use rate('{block.name}') or before('{block.name}')"
        )
        raise ProblemError(
            f"'{name}' uses previous('{block.name}'), which only link rows may use; "
            f"state a link row{states}"
        )


def _users(
    terms: list[tuple[str, Expression]], blocks: list[Block], symbol: str
) -> Iterator[tuple[str, Block]]:
    """Names of terms that depend on one of the symbols of the blocks, each with the block."""
    every = ca.vertcat(*(getattr(b, symbol) for b in blocks))
    for name, expression in terms:
        if ca.depends_on(expression, every):
            yield from ((name, b) for b in blocks if ca.depends_on(expression, getattr(b, symbol)))


def _check_terminal(problem: Problem) -> None:
    terms = [(t.name, t.expression) for t in problem.costs if t.at != "running"]
    terms += [(r.name, r.expression) for r in problem.rows if r.at != "running"]
    for name, expression in terms:
        for block in problem.blocks:
            if not block.is_state and ca.depends_on(expression, block.symbol):
                raise ProblemError(
                    f"'{name}' holds at the terminal knot but uses '{block.name}', "
                    "which is not a state and does not exist there"
                )
