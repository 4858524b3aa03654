"""Checks of numbers that a user gives; every error names the field, its value and the rule."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import ArrayLike

from palanquin.errors import ProblemError


def positive(field: str, value: float) -> float:
    """`value` as a float; raises ProblemError unless it is finite and positive."""
    number = _number(field, value)
    if not (np.isfinite(number) and number > 0):
        raise ProblemError(f"{field} is {value}; it must be positive and finite")
    return number


def non_negative(field: str, value: float) -> float:
    """`value` as a float; raises ProblemError unless it is finite and at least 0."""
    number = _number(field, value)
    if not (np.isfinite(number) and number >= 0):
        raise ProblemError(f"{field} is {value}; it must be finite and at least 0")
    return number


def finite(field: str, value: float) -> float:
    """`value` as a float; raises ProblemError unless it is finite."""
    number = _number(field, value)
    if not np.isfinite(number):
        raise ProblemError(f"{field} is {value}; it must be finite")
    return number


def array(field: str, value: ArrayLike, *shape: int) -> np.ndarray:
    """`value` as a float array; raises ProblemError unless it has `shape` and is finite."""
    try:
        result = np.asarray(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise ProblemError(f"{field} is not an array of numbers: {value!r}") from error
    if result.shape != shape:
        raise ProblemError(f"{field} has shape {result.shape}; {shape} is needed")
    if not np.isfinite(result).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(result))[0])
        raise ProblemError(f"{field}{list(where)} is {result[where]}; it must be finite")
    return result


def positive_array(field: str, value: ArrayLike, *shape: int) -> np.ndarray:
    """`array` whose entries are all positive."""
    result = array(field, value, *shape)
    if (result <= 0).any():
        raise ProblemError(f"{field} is {result.tolist()}; every entry must be positive")
    return result


def unit_quaternion(field: str, value: ArrayLike) -> np.ndarray:
    """`value` [..., 4] (w, x, y, z) normalised; raises ProblemError where its norm is near 0."""
    result = np.asarray(value, dtype=float)
    norm = np.linalg.norm(result, axis=-1, keepdims=True)
    if not (norm > 1e-6).all():
        raise ProblemError(f"{field} has norm {norm.min():g}; a quaternion needs a norm of about 1")
    return result / norm


def _number(field: str, value: float) -> float:
    try:
        return float(value)
    except (TypeError, ValueError) as error:
        raise ProblemError(f"{field} is {value!r}; a number is needed") from error


@contextmanager
def of_the_engine() -> Iterator[None]:
    """Bad values that the engine finds, as errors of the problem."""
    try:
        yield
    except ValueError as error:
        raise ProblemError(str(error)) from error
