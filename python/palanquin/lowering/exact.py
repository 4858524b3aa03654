"""Exact Hessians of the Lagrangian in the tangent space."""

from __future__ import annotations

import casadi as ca

from palanquin import quaternion
from palanquin.lowering.dynamics import explicit_next_state, split_states
from palanquin.lowering.knot import function, knot_symbols, pruned
from palanquin.lowering.stage import exact_tangent_hessian, row_lagrangian, total_cost
from palanquin.problem import Problem


def exact_hessian_functions(problem: Problem) -> list[ca.Function]:
    """Hessians of cost + multipliers' rows in the tangent space, lower triangles.

    exact_running(z, p, charted, lambda_d, lambda_g, lambda_h) and
    exact_terminal(z, p, lambda_g, lambda_h), where lambda_d belongs to the dynamics made explicit,
    x_{k+1} = d(z_k, p_k), with rows in the tangent space at d: so the curvature of semi-implicit
    rows stays within one knot. `charted` has a flag per block; where it is set the block moves on
    its chart, whose curvature is added to the columns of the coordinates. Link rows, which would
    couple two knots, are left out.
    """
    k = knot_symbols(problem)
    states = [b for b in problem.blocks if b.is_state]
    multiplier_d = ca.SX.sym("lambda_d", sum(b.tangent_size for b in states))
    d = explicit_next_state(problem)
    frozen = ca.SX.sym("d", d.shape)
    lagrangian, offset = ca.SX(0), 0
    for block, value, base in zip(
        states, split_states(d, states), split_states(frozen, states), strict=True
    ):
        part = multiplier_d[offset : offset + block.tangent_size]
        # 2 vec(base^-1 * value) has log's value, slope and curvature at the identity.
        step = (
            2 * quaternion.multiply(quaternion.conjugate(base), value)[1:4]
            if block.is_quaternion
            else value
        )
        lagrangian += ca.dot(part, step)
        offset += block.tangent_size
    rows, multipliers = row_lagrangian(problem, "running")
    gradient, hessian = exact_tangent_hessian(
        problem, k, lagrangian + rows + total_cost(problem, "running")
    )
    charted = ca.SX.sym("charted", len(problem.blocks))
    hessian += _chart_curvature(problem, gradient, charted)
    hessian = ca.substitute(hessian, frozen, d)
    running = function(
        problem,
        "exact_running",
        [k.z, k.p, charted, multiplier_d, *multipliers],
        [pruned(ca.tril(hessian))],
    )
    rows, multipliers = row_lagrangian(problem, "terminal")
    _, hessian = exact_tangent_hessian(problem, k, rows + total_cost(problem, "terminal"))
    terminal = function(problem, "exact_terminal", [k.z, k.p, *multipliers], [ca.tril(hessian)])
    return [running, terminal]


def _chart_curvature(problem: Problem, gradient: ca.SX, charted: ca.SX) -> ca.SX:
    """sum_i gradient_i d2(embed_i)/dy2 [ndz, ndz], in the columns of the charts' coordinates y."""
    curvature, offset = ca.SX(gradient.shape[0], gradient.shape[0]), 0
    for index, b in enumerate(problem.blocks):
        if b.chart is not None:
            y = ca.SX.sym("y", b.chart.coordinates)
            slope = ca.SX.sym("slope", b.size)
            hessian = ca.hessian(ca.dot(slope, b.chart.embed(y)), y)[0]
            at = (b.symbol[: b.chart.coordinates], gradient[offset : offset + b.size])
            hessian = ca.substitute(hessian, ca.vertcat(y, slope), ca.vertcat(*at))
            own = slice(offset, offset + b.chart.coordinates)
            curvature[own, own] = charted[index] * hessian
        offset += b.tangent_size
    return curvature
