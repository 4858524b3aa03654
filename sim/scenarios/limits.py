"""Ranges of the numbers that a run of bar carriers takes; errors name field, value and rule."""

from __future__ import annotations

from numbers import Integral, Real
from typing import Any

from palanquin.schema import LAST_SEED
from palanquin.sim.errors import InputError

TIMESTEP = 1e-3
"""Of physics and controllers, s."""


def require_number(field: str, value: Any, low: float, high: float, unit: str = "") -> None:
    """Raises InputError unless `value` is a number from `low` to `high`."""
    is_number = isinstance(value, Real) and not isinstance(value, bool)
    if not (is_number and low <= value <= high):
        shown = f"{value} {unit}".rstrip() if is_number else repr(value)
        raise InputError(f"{field}: {shown} must be from {low:g} to {high:g}")


def require_integer(field: str, value: Any, low: int, high: int) -> None:
    """Raises InputError unless `value` is an integer from `low` to `high`."""
    is_integer = isinstance(value, Integral) and not isinstance(value, bool)
    if not (is_integer and low <= value <= high):
        raise InputError(f"{field}: {value!r} must be from {low} to {high}, an integer")


def require_seed(field: str, value: Any) -> None:
    """Raises InputError unless `value` seeds all random draws."""
    require_integer(field, value, 0, LAST_SEED)


def timesteps(field: str, seconds: float, at_least: int = 0) -> int:
    """How many physics steps a time has; raises InputError unless it is a multiple of one."""
    steps = round(seconds / TIMESTEP)
    if abs(steps * TIMESTEP - seconds) > 1e-9 or steps < at_least:
        least = f", {at_least} or more of them" if at_least else ""
        raise InputError(
            f"{field}: {seconds} s must be whole physics steps of {TIMESTEP:g} s{least}"
        )
    return steps
