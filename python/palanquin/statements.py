"""Checks of what a user states: names, places, horizons, shapes of expressions."""

from __future__ import annotations

import re
from typing import Any

import casadi as ca
import numpy as np

from palanquin.errors import ProblemError
from palanquin.terms import At, Expression

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.\-]*")


def checked_horizon(horizon: Any) -> int:
    """A number of intervals; raises ProblemError for anything else."""
    if not isinstance(horizon, (int, np.integer)) or isinstance(horizon, bool) or horizon < 1:
        raise ProblemError(f"horizon is {horizon!r}; it must be an integer of at least 1")
    return int(horizon)


def checked_name(what: str, name: str) -> str:
    """A name that may stand in messages and manifests; raises ProblemError for any other."""
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise ProblemError(
            f"{what} name {name!r} must start with a letter and hold letters, digits, _ . -"
        )
    return name


def checked_at(name: str, at: str) -> At:
    """Where a term holds; raises ProblemError for anything but running, terminal and all."""
    if at not in ("running", "terminal", "all"):
        raise ProblemError(f"'{name}': at is {at!r}; it must be 'running', 'terminal' or 'all'")
    return at  # type: ignore[return-value]


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
