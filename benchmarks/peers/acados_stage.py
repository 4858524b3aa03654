"""One stage of a `Problem` as acados takes it: fixed sizes, flags as parameters, penalties as cost.

Roles are expressed in the model: the state holds the blocks that may be carried on, and a knot's
value of such a block is the state's or the input's, as the flags say. Rows that hold by
construction then do not appear, as in our reduced form; inputs that a knot does not use stay.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from palanquin import lowering
from palanquin.benchmarks.peers.penalties import curvature, value
from palanquin.errors import ProblemError
from palanquin.problem import Block, Problem, Role

# Keeps the Hessian of inputs without effect positive definite; it is not part of the cost.
_PROXIMAL = 1e-8


@dataclass(frozen=True)
class Stage:
    """Expressions over s (states, then blocks that may be carried), u (all others) and p.

    Hessians are Gauss-Newton with the penalties' curvature, over (u, s), at the last knot over s.
    """

    s: ca.SX
    u: ca.SX
    p: ca.SX
    z: ca.SX  # the knot vector
    following: ca.SX  # s at the next knot
    cost: ca.SX
    hessian: ca.SX
    terminal_cost: ca.SX
    terminal_hessian: ca.SX


def build_stage(problem: Problem, kept: list[Block]) -> Stage:
    """The stage of a problem whose blocks `kept` may be carried on.

    Raises ProblemError for rows that are no inequalities.
    """
    for row in problem.rows:
        if row.kind != "inequality":
            raise ProblemError(f"acados: row '{row.name}' is no inequality")
    knot = lowering.knot_symbols(problem)
    states = [b for b in problem.blocks if b.is_state]
    previous = {b.name: ca.SX.sym(f"{b.name}-", b.size) for b in kept}
    inputs = {b.name: ca.SX.sym(f"{b.name}*", b.size) for b in problem.blocks if not b.is_state}
    values = [
        b.symbol if b.is_state else _value(b, inputs[b.name], previous.get(b.name))
        for b in problem.blocks
    ]
    z = ca.vertcat(*values)
    s = ca.vertcat(*(b.symbol for b in states), *previous.values())
    u = ca.vertcat(*inputs.values())
    d = ca.substitute(lowering.explicit_next_state(problem), knot.z, z)
    held = [v for b, v in zip(problem.blocks, values, strict=True) if b.name in previous]
    cost, hessian = _cost(problem, knot.z, z, "running", ca.vertcat(u, s))
    terminal_cost, terminal_hessian = _cost(problem, knot.z, knot.z, "terminal", s)
    return Stage(
        s, u, knot.p, z, ca.vertcat(d, *held), cost, hessian, terminal_cost, terminal_hessian
    )


def _value(block: Block, given: ca.SX, previous: ca.SX | None) -> ca.SX:
    """The block's value at a knot: embedded in its chart, carried on, or zero, by its role."""
    free = given
    if block.chart is not None:
        embedded = block.chart.embed(given[: block.chart.coordinates])
        free = ca.if_else(block.chart.active, embedded, given)
    present = ca.if_else(block.role == Role.ABSENT, 0, free)
    if previous is None:
        return present
    return ca.if_else(block.role == Role.CARRIED, previous, present)


def _cost(
    problem: Problem, symbol: ca.SX, z: ca.SX, at: str, variables: ca.SX
) -> tuple[ca.SX, ca.SX]:
    cost, hessian = ca.SX(0), _PROXIMAL * ca.SX.eye(variables.numel())
    for term in problem.costs:
        if term.at not in (at, "all"):
            continue
        if term.weight is None:
            raise ProblemError(f"acados: cost '{term.name}' is not a least-squares residual")
        residual = ca.substitute(term.expression, symbol, z)
        J = ca.jacobian(residual, variables)
        cost += ca.dot(term.weight, residual**2)
        hessian += 2 * J.T @ ca.diag(term.weight) @ J
    for group in lowering.groups_at(problem, "inequality", at):
        h = ca.substitute(group.expression, symbol, z)
        J = ca.jacobian(h, variables)
        cost += group.active * ca.sum1(value(group, h))
        hessian += J.T @ ca.diag(group.active * curvature(group, h)) @ J
    return cost, hessian
