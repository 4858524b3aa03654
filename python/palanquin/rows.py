"""Constraint rows as a user states them: options, relations, policies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import casadi as ca
import numpy as np

from palanquin import policies
from palanquin.errors import ProblemError
from palanquin.statements import (
    checked_at,
    checked_column,
    checked_name,
    checked_options,
    checked_value,
)
from palanquin.terms import Expression, RowGroup

RowKind = Literal["equality", "inequality", "link"]


_OPTIONS = ("at", "robot", "limb", "active", "scale")


def row_group(
    kind: RowKind,
    name: str,
    expression: Expression,
    policy: policies.Policy,
    options: Mapping[str, Any],
) -> RowGroup:
    """Checked rows; raises ProblemError that names the option and its rule.

    `Problem.inequality` says what the options mean.
    """
    what = f"{kind} '{checked_name(kind, name)}'"
    valid = [*_OPTIONS, *(["policy"] if kind == "inequality" else [])]
    checked_options(what, options, valid)
    at = checked_at(name, options.get("at", "running"))
    if kind == "link" and at != "running":
        raise ProblemError(f"{what}: at is '{at}'; link rows hold at running knots only")
    robot, limb = options.get("robot", ""), options.get("limb", "")
    for label in filter(None, (robot, limb)):
        checked_name(f"{what}: owner", label)
    scale = options.get("scale", 1.0)
    if not (np.isfinite(scale) and scale > 0):
        raise ProblemError(f"{what}: scale is {scale}; it must be positive")
    return RowGroup(
        name=name,
        kind=kind,
        at=at,
        expression=_difference(what, kind, checked_column(what, expression)),
        active=checked_column(f"{what} active", ca.SX(options.get("active", 1.0)), 1),
        robot=robot,
        limb=limb,
        policy=policy,
        scale=float(scale),
    )


def checked_policy(name: str, policy: Any) -> policies.Policy:
    """The policy that a user gave, `Penalty()` for None; raises ProblemError for anything else."""
    if policy is None:
        return policies.Penalty()
    if not isinstance(policy, policies.Policy):
        known = ", ".join(kind.__name__ for kind in policies.Policy.__subclasses__())
        raise ProblemError(f"inequality '{name}': policy is {policy!r}; it must be one of {known}")
    return policy


def two_sided(name: str, expression: Expression, lower: Any, upper: Any) -> Expression:
    """Rows h <= 0 that say lower <= expression <= upper; infinite entries say nothing."""
    what = f"bound '{name}'"
    value = checked_value(what, expression)
    low, high = (
        _side(f"{what} {side}", given, value.numel(), empty)
        for side, given, empty in (("lower", lower, -np.inf), ("upper", upper, np.inf))
    )
    rows = []
    for i in range(value.numel()):
        ends = [end[i] for end in (low, high)]
        if all(end.is_constant() for end in ends) and float(ends[0]) > float(ends[1]):
            raise ProblemError(f"{what}: entry {i} has lower {ends[0]} above upper {ends[1]}")
        rows += [value[i] - ends[1]] if _bounds(ends[1]) else []
        rows += [ends[0] - value[i]] if _bounds(ends[0]) else []
    if not rows:
        raise ProblemError(f"{what}: neither lower nor upper bounds anything")
    return ca.vertcat(*rows)


def _side(what: str, given: Any, size: int, empty: float) -> Expression:
    """One side as a column [size]."""
    side = checked_column(what, ca.SX(empty if given is None else given))
    if side.numel() == 1:
        side = ca.repmat(side, size, 1)
    if side.numel() != size:
        raise ProblemError(f"{what} has {side.numel()} entries; 1 or {size} are needed")
    if any(end.is_constant() and np.isnan(float(end)) for end in ca.vertsplit(side)):
        raise ProblemError(f"{what} is not a number")
    return side


def _bounds(end: Expression) -> bool:
    return not (end.is_constant() and np.isinf(float(end)))


_RELATIONS = {
    ca.OP_LE: "<=", ca.OP_LT: "<", ca.OP_EQ: "==", ca.OP_NE: "!=",
    ca.OP_AND: "and", ca.OP_OR: "or", ca.OP_NOT: "not",
}  # fmt: skip
_UNDERSTOOD = {"inequality": ("<=", "<"), "equality": ("==",), "link": ("==",)}


def relation(scalar: Expression) -> str:
    """The relation that a scalar expression is, "" for one that is a number."""
    return "" if scalar.is_leaf() else _RELATIONS.get(scalar.op(), "")


def _difference(what: str, kind: RowKind, column: Expression) -> Expression:
    """Rows with a <= b (or a == b) written as a - b. CasADi writes a >= b as b <= a, and a relation
    between numbers as 1 or 0: what it was can't be told any more.
    """
    given = ca.vertsplit(column)
    has_relations = any(map(relation, given)) or column.is_constant()
    rows = []
    for index, row in enumerate(given):
        sign = relation(row)
        if has_relations and row.is_constant():
            raise ProblemError(
                f"{what}: row {index} holds no variable and no parameter; leave it out"
            )
        if sign and sign not in _UNDERSTOOD[kind]:
            raise ProblemError(
                f"{what}: row {index} is a relation by '{sign}'; "
                f"state a {_UNDERSTOOD[kind][0]} b, or an expression"
            )
        rows.append(row.dep(0) - row.dep(1) if sign else row)
        if not _is_finite(rows[-1]):
            raise ProblemError(f"{what}: row {index} has a bound that is not finite; leave it out")
    return ca.vertcat(*rows)


def _is_finite(row: Expression) -> bool:
    """Whether no bound in `row`, a constant or a sum with one, is infinite or NaN."""
    terms = [row] if row.is_leaf() else [row.dep(i) for i in range(row.n_dep())]
    return all(bool(np.isfinite(float(t))) for t in terms if t.is_constant())
