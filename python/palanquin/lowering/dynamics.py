"""The next state of a knot and its derivatives in the tangent space."""

from __future__ import annotations

from collections.abc import Iterable

import casadi as ca

from palanquin import quaternion
from palanquin.errors import ProblemError
from palanquin.lowering.knot import Knot, pruned
from palanquin.problem import Block, Problem
from palanquin.terms import Dynamics


def next_state(problem: Problem) -> ca.SX:
    """Ambient next value of all states, d(z, x+, p); quaternions stated by value are normalised."""
    values = []
    for block in problem.blocks:
        if not block.is_state:
            continue
        dynamics = problem.dynamics_of(block)
        if not dynamics.is_increment:
            values.append(stated_value(block, dynamics))
        elif block.is_quaternion:
            values.append(quaternion.multiply(block.symbol, quaternion.exp(dynamics.expression)))
        else:
            values.append(block.symbol + dynamics.expression)
    return ca.vertcat(*values)


def stated_value(block: Block, dynamics: Dynamics) -> ca.SX:
    """The next value that a problem states, on the block's manifold."""
    value = dynamics.expression
    return value / ca.norm_2(value) if block.is_quaternion else value


def explicit_next_state(problem: Problem) -> ca.SX:
    """The next state d with every x+ on its right-hand side replaced by its own dynamics."""
    states = [b for b in problem.blocks if b.is_state]
    values = {
        b.name: v for b, v in zip(states, split_states(next_state(problem), states), strict=True)
    }
    for block in elimination_order(problem, states):
        for other in states:
            if other is not block and ca.depends_on(values[other.name], block.next_symbol):
                values[other.name] = ca.substitute(
                    values[other.name], block.next_symbol, values[block.name]
                )
    return ca.vertcat(*(values[b.name] for b in states))


def split_states(stacked: ca.SX, blocks: list[Block]) -> list[ca.SX]:
    """Ambient values of the blocks that are stacked one after the other."""
    return ca.vertsplit(stacked, [0, *_running_sum(b.size for b in blocks)])


def _running_sum(sizes: Iterable[int]) -> list[int]:
    total, sums = 0, []
    for size in sizes:
        total += size
        sums.append(total)
    return sums


def elimination_order(problem: Problem, states: list[Block]) -> list[Block]:
    """States ordered so that each one's dynamics use next values of earlier ones only."""
    values = dict(
        zip((b.name for b in states), split_states(next_state(problem), states), strict=True)
    )
    uses = {
        b.name: {o.name for o in states if ca.depends_on(values[b.name], o.next_symbol)}
        for b in states
    }
    ordered: list[Block] = []
    while len(ordered) < len(states):
        done = {b.name for b in ordered}
        ready = [b for b in states if b.name not in done and uses[b.name] <= done]
        if not ready:
            stuck = sorted(set(uses) - done)
            raise ProblemError(
                f"dynamics of {', '.join(stuck)} depend on each other's next values in a cycle"
            )
        ordered += ready
    return ordered


def state_jacobians(problem: Problem, knot: Knot) -> tuple[ca.SX, ca.SX]:
    """(dd/dz [ndx, ndz], dd/dx+ [ndx, ndx]), rows in the tangent space at d."""
    rows, rows_next = [], []
    offset = 0
    for block in problem.blocks:
        if block.is_state:
            dynamics = problem.dynamics_of(block)
            source = dynamics.expression
            jac = ca.jacobian(source, knot.z) @ knot.tangent
            jac_next = ca.jacobian(source, knot.z_next) @ knot.tangent_next
            if dynamics.is_increment:
                own = ca.SX(block.tangent_size, knot.tangent.shape[1])
                if block.is_quaternion:
                    right = quaternion.right_jacobian(source)
                    jac, jac_next = right @ jac, right @ jac_next
                    own[:, offset : offset + 3] = quaternion.rotation_matrix_of_vector(-source)
                else:
                    own[:, offset : offset + block.size] = ca.SX.eye(block.size)
                jac = own + jac
            elif block.is_quaternion:
                # With d = value / |value|, the tangent at d of a change of the value is
                # 2 vec(conj(d) change) / |value|: what lies along d changes no orientation.
                to_tangent = 4 * quaternion.tangent_map(source).T / ca.sumsqr(source)
                jac, jac_next = to_tangent @ jac, to_tangent @ jac_next
            rows.append(jac)
            rows_next.append(jac_next)
        offset += block.tangent_size
    return pruned(ca.vertcat(*rows)), pruned(ca.vertcat(*rows_next))
