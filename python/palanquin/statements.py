"""Checks of what a user states: names, places, horizons, shapes of expressions."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from typing import Any

import casadi as ca
import numpy as np

from palanquin.errors import ProblemError
from palanquin.terms import At, Expression

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.\-]*")
_LONGEST_NAME = 100  # names of problems become names of files
_LONGEST_HORIZON = 10**7


def checked_horizon(horizon: Any) -> int:
    """A number of intervals; raises ProblemError for anything else."""
    if not isinstance(horizon, (int, np.integer)) or isinstance(horizon, bool) or horizon < 1:
        raise ProblemError(f"horizon is {horizon!r}; it must be an integer of at least 1")
    if horizon > _LONGEST_HORIZON:
        raise ProblemError(f"horizon is {horizon}; it must be at most {_LONGEST_HORIZON}")
    return int(horizon)


def checked_name(what: str, name: str) -> str:
    """A name that may stand in messages and manifests; raises ProblemError for any other."""
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise ProblemError(
            f"{what} name {name!r} must start with a letter and hold letters, digits, _ . -"
        )
    if len(name) > _LONGEST_NAME:
        raise ProblemError(
            f"{what} name {name[:20]!r}... has {len(name)} letters; at most {_LONGEST_NAME} may be"
        )
    return name


def checked_at(name: str, at: str) -> At:
    """Where a term holds; raises ProblemError for anything but running, terminal and all."""
    if at not in ("running", "terminal", "all"):
        raise ProblemError(f"'{name}': at is {at!r}; it must be 'running', 'terminal' or 'all'")
    return at  # type: ignore[return-value]


def checked_size(what: str, size: Any, largest: int | None = None) -> int:
    """A count of at least 1, of any integer type; raises ProblemError for anything else."""
    size = size.item() if isinstance(size, np.generic) else size
    is_integer = isinstance(size, int) and not isinstance(size, bool)
    if not is_integer or size < 1 or (largest is not None and size > largest):
        rule = "it must be at least 1" if largest is None else f"1 to {largest} is needed"
        raise ProblemError(f"{what} is {size!r}; {rule}")
    return int(size)


def checked_shape(name: str, shape: Any) -> tuple[int, ...]:
    """A parameter's n or (rows, columns); raises ProblemError for anything else."""
    dims = (shape,) if np.ndim(shape) == 0 else tuple(shape)
    try:
        sizes = tuple(checked_size(name, d) for d in dims)
    except ProblemError:
        sizes = ()
    if not 1 <= len(sizes) <= 2:
        raise ProblemError(f"parameter '{name}': shape {shape!r} must be n or (rows, columns)")
    return sizes


def checked_options(what: str, options: Iterable[str], valid: Collection[str]) -> None:
    """Raises ProblemError that lists the valid options when there is another among `options`."""
    for option in options:
        if option not in valid:
            raise ProblemError(
                f"{what}: there is no option '{option}'; valid ones are {', '.join(valid)}"
            )


def checked_value(what: str, expression: Any, size: int | None = None) -> Expression:
    """A column of numbers to minimise; raises ProblemError for relations, which are none."""
    column = checked_column(what, expression, size)
    for index, entry in enumerate(ca.vertsplit(column)):
        if not entry.is_leaf() and entry.op() in (ca.OP_LE, ca.OP_LT, ca.OP_EQ, ca.OP_NE):
            raise ProblemError(f"{what}: row {index} is a relation, {entry}; costs are numbers")
    return column


def checked_weights(what: str, weight: Any, size: int) -> Expression:
    """A column of `size` weights from one or as many; raises ProblemError for a negative one."""
    weights = checked_column(what, weight)
    if weights.numel() == 1:
        weights = ca.repmat(weights, size, 1)
    weights = checked_column(what, weights, size)
    for index, entry in enumerate(ca.vertsplit(weights)):
        if entry.is_constant() and not 0.0 <= float(entry) < float("inf"):
            raise ProblemError(
                f"{what} is {float(entry)} in row {index}; it must be finite and not negative"
            )
    return weights


def checked_column(what: str, expression: Any, size: int | None = None) -> Expression:
    """A dense column, of `size` rows if that is given; raises ProblemError for other shapes."""
    try:
        column = ca.densify(ca.SX(expression))
    except (NotImplementedError, TypeError, RuntimeError) as error:
        raise ProblemError(f"{what} is not a CasADi expression: {expression!r}") from error
    if column.shape[1] != 1 or column.shape[0] < 1:
        raise ProblemError(f"{what} has shape {column.shape}; a column vector is needed")
    if size is not None and column.shape[0] != size:
        raise ProblemError(f"{what} has {column.shape[0]} rows; {size} are needed")
    return column
