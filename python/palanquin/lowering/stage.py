"""Costs and rows of one knot and their derivatives in the tangent space."""

from __future__ import annotations

import casadi as ca

from palanquin import quaternion
from palanquin.lowering.knot import Knot, pruned
from palanquin.lowering.role_rows import role_rows
from palanquin.problem import Block, Problem, RowGroup

ROW_ORDER = (
    ("equality", "running"),
    ("inequality", "running"),
    ("link", "running"),
    ("equality", "terminal"),
    ("inequality", "terminal"),
)


def groups_at(problem: Problem, kind: str, at: str) -> list[RowGroup]:
    """Row groups of a kind that hold at 'running' or 'terminal' knots.

    Those that the problem states, in order of statement, then those that its blocks' roles and
    charts imply.
    """
    stated = [r for r in problem.rows if r.kind == kind and r.at in (at, "all")]
    return stated + (role_rows(problem.blocks, kind) if at == "running" else [])


def stacked_rows(problem: Problem, kind: str, at: str) -> ca.SX:
    """Rows of a kind stacked in the order of `groups_at`; shape [0, 1] when there are none."""
    groups = groups_at(problem, kind, at)
    return ca.vertcat(*(r.expression for r in groups)) if groups else ca.SX(0, 1)


def stage_values(problem: Problem, at: str) -> list[ca.SX]:
    """Cost, equality rows and inequality rows."""
    return [
        total_cost(problem, at),
        stacked_rows(problem, "equality", at),
        stacked_rows(problem, "inequality", at),
    ]


def row_jacobians(problem: Problem, k: Knot, at: str) -> list[ca.SX]:
    """Jacobians of equality and inequality rows in the tangent space."""
    return [
        pruned(ca.jacobian(stacked_rows(problem, kind, at), k.z) @ k.tangent)
        for kind in ("equality", "inequality")
    ]


def row_lagrangian(problem: Problem, at: str) -> tuple[ca.SX, list[ca.SX]]:
    """Multipliers times rows, and the multipliers of equality and inequality rows."""
    total, multipliers = ca.SX(0), []
    for kind in ("equality", "inequality"):
        rows = stacked_rows(problem, kind, at)
        multiplier = ca.SX.sym(f"lambda_{kind}", rows.shape[0])
        multipliers.append(multiplier)
        total += ca.dot(multiplier, rows)
    return total, multipliers


def total_cost(problem: Problem, at: str) -> ca.SX:
    """Scalar cost at 'running' or 'terminal' knots, penalties not included."""
    cost = ca.SX(0)
    for term in problem.costs:
        if term.at in (at, "all"):
            if term.weight is None:
                cost += term.expression
            else:
                cost += ca.dot(term.weight, term.expression**2)
    return cost


def cost_derivatives(problem: Problem, knot: Knot, at: str) -> tuple[ca.SX, ca.SX]:
    """Gradient [ndz] and Hessian's lower triangle [ndz, ndz] of the cost in the tangent space.

    Gauss-Newton (2 J'WJ) for residuals, exact for general costs.
    """
    size = knot.tangent.shape[1]
    gradient, hessian = ca.SX(size, 1), ca.SX(size, size)
    for term in problem.costs:
        if term.at not in (at, "all"):
            continue
        if term.weight is None:
            g, h = exact_tangent_hessian(problem, knot, term.expression)
        else:
            jac = pruned(ca.jacobian(term.expression, knot.z) @ knot.tangent)
            weighted = 2 * ca.diag(term.weight) @ jac
            g, h = weighted.T @ term.expression, jac.T @ weighted
        gradient += g
        hessian += h
    return ca.densify(gradient), pruned(ca.tril(hessian))


def exact_tangent_hessian(problem: Problem, knot: Knot, scalar: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Gradient [ndz] and full Hessian [ndz, ndz] of dz -> scalar(z (+) dz) at dz = 0."""
    step = ca.SX.sym("dz", knot.tangent.shape[1])
    moved = ca.substitute(scalar, knot.z, _retract_second_order(problem.blocks, step))
    hessian, gradient = ca.hessian(moved, step)
    zero = ca.DM.zeros(step.shape)
    return ca.substitute(gradient, step, zero), pruned(ca.substitute(hessian, step, zero))


def _retract_second_order(blocks: list[Block], step: ca.SX) -> ca.SX:
    moved, offset = [], 0
    for b in blocks:
        part = step[offset : offset + b.tangent_size]
        if b.is_quaternion:
            moved.append(quaternion.multiply(b.symbol, quaternion.exp_second_order(part)))
        else:
            moved.append(b.symbol + part)
        offset += b.tangent_size
    return ca.vertcat(*moved)
