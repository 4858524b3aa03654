"""Rows h <= 0 softened by slacks: h <= s, s >= 0, at the price l1 s + l2 s^2."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import casadi as ca

from palanquin import policies
from palanquin.rows import row_group
from palanquin.terms import Expression, Role

if TYPE_CHECKING:
    from palanquin.problem import Problem


def state_slacks(
    problem: Problem,
    name: str,
    expression: Expression,
    policy: policies.Slack,
    options: Mapping[str, Any],
) -> None:
    """Adds the rows of `Problem.inequality` with a slack for each, at its knot.

    A running knot's slacks are a local block NAME.slack, which meets the costs and rows of its own
    knot alone. The terminal knot has no blocks but states: its slacks are an input NAME.end_slack
    of the last running knot, which a state hands over.
    """
    group = row_group("inequality", name, expression, policies.Hard(), options)  # checked
    rest = {key: value for key, value in options.items() if key != "at"}
    label = _free_name(problem, f"{name}.slack")
    size = group.expression.numel()
    if group.at in ("running", "all"):
        s = problem.variable(label, size, role=Role.LOCAL)
        problem.inequality(name, group.expression - s, policies.Hard(), **rest)
        _price(problem, label, s, policy)
    if group.at in ("terminal", "all"):
        label = _free_name(problem, f"{name}.end_slack")
        last = problem.last_knot
        s = problem.variable(label, size, role=ca.if_else(last, int(Role.INPUT), int(Role.ABSENT)))
        beyond = group.expression - problem.before(s)
        problem.inequality(name, beyond, policies.Hard(), at="terminal", **rest)
        _price(problem, label, s, policy, last)


def _price(
    problem: Problem,
    label: str,
    s: Expression,
    policy: policies.Slack,
    active: Expression | float = 1.0,
) -> None:
    problem.inequality(label, -s, policies.Hard(), active=active)
    problem.cost(label, policy.l1 * ca.sum1(s) + policy.l2 * ca.sumsqr(s))


def _free_name(problem: Problem, name: str) -> str:
    """The name, with a number where owners share a family."""
    taken = {block.name for block in problem.blocks}
    numbered = (f"{name}{i}" for i in range(2, len(taken) + 3))
    return name if name not in taken else next(n for n in numbered if n not in taken)
