"""The symbols of one knot, and functions over them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca

from palanquin import quaternion
from palanquin.errors import ProblemError
from palanquin.problem import Block, Problem


@dataclass(frozen=True)
class Knot:
    """The symbols of one knot and the expressions stated over them."""

    z: ca.SX
    z_next: ca.SX
    z_previous: ca.SX
    p: ca.SX
    tangent: ca.SX  # [nz, ndz] block-diagonal derivative of z (+) dz
    tangent_next: ca.SX  # [nz, ndx] the same at z+, columns of states only
    tangent_previous: ca.SX


def knot_symbols(problem: Problem) -> Knot:
    """Stacks block and parameter symbols in their order of statement."""
    blocks = problem.blocks
    if not blocks:
        raise ProblemError(f"problem '{problem.name}' has no variables")
    states = [b for b in blocks if b.is_state]
    if not states:
        raise ProblemError(f"problem '{problem.name}' has no state")
    z_next = ca.vertcat(*(b.next_symbol for b in blocks))
    return Knot(
        z=ca.vertcat(*(b.symbol for b in blocks)),
        z_next=z_next,
        z_previous=ca.vertcat(*(b.previous_symbol for b in blocks)),
        p=ca.vertcat(*(q.symbol for q in problem.parameters)),
        tangent=_tangent(blocks, lambda b: b.symbol),
        tangent_next=_tangent(blocks, lambda b: b.next_symbol)[:, _columns(blocks, states)],
        tangent_previous=_tangent(blocks, lambda b: b.previous_symbol),
    )


def _tangent(blocks: list[Block], symbol_of: Callable[[Block], ca.SX]) -> ca.SX:
    return ca.diagcat(
        *(
            quaternion.tangent_map(symbol_of(b)) if b.is_quaternion else ca.SX.eye(b.size)
            for b in blocks
        )
    )


def _columns(blocks: list[Block], chosen: list[Block]) -> list[int]:
    columns: list[int] = []
    offset = 0
    for b in blocks:
        if b in chosen:
            columns += range(offset, offset + b.tangent_size)
        offset += b.tangent_size
    return columns


def pruned(matrix: ca.SX) -> ca.SX:
    """Drops entries that are zero as expressions."""
    return ca.sparsify(matrix)


def function(
    problem: Problem, name: str, arguments: list[ca.SX], results: list[ca.SX]
) -> ca.Function:
    """A CasADi function; raises ProblemError if the results need a symbol that is not there."""
    try:
        return ca.Function(name, arguments, ca.cse(results))
    except RuntimeError as error:
        known = {e.name() for a in arguments for e in ca.vertsplit(a)}
        used = {s.name() for r in results for s in ca.symvar(r)}
        unknown = sorted(used - known)
        raise ProblemError(
            f"problem '{problem.name}': {name} depends on {', '.join(unknown) or error}, "
            "which is not available there (terminal terms cannot use next values, "
            "and every symbol must come from this problem)"
        ) from error
