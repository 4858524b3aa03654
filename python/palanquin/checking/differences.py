"""Finite differences that know how far they can be trusted."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palanquin.checking.report import Finding, Kind

Array = NDArray[np.float64]

STEP = 1e-6
TOLERANCE = 1e-6  # relative to the largest entry of the row
_EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Differences:
    """Central differences [m, n] of m values in n directions.

    Attributes:
        slope: (f(h) - f(-h)) / 2h.
        uncertainty: bound on its error: truncation, from two step sizes, and rounding.
        is_broken: where the one-sided slopes do not approach each other as h shrinks: a kink.
    """

    slope: Array
    uncertainty: Array
    is_broken: NDArray[np.bool_]


def differences(function: Callable[[Array], Array], size: int) -> Differences:
    """Of function(d) [m] at d = 0 in R^size."""
    middle = function(np.zeros(size))
    if not size:
        empty = np.zeros((middle.size, 0))
        return Differences(empty, empty, empty.astype(bool))

    def sides(h: float) -> tuple[Array, Array]:
        """Slopes of chords, and the gap between the one-sided slopes, [m, n]."""
        pairs = [(function(h * d), function(-h * d)) for d in np.eye(size)]
        ahead, behind = (np.array(part).T for part in zip(*pairs, strict=True))
        return (ahead - behind) / (2 * h), np.abs(ahead - 2 * middle[:, None] + behind) / h

    with np.errstate(all="ignore"):
        (slope, gap), (coarse, coarse_gap) = sides(STEP), sides(2 * STEP)
        # What adds up to a value may be larger than the value: as large as its steepest slope times
        # variables of about this size.
        typical = 10 * np.where(np.isfinite(slope), np.abs(slope), 0).max(axis=1)
        rounding = (4 * _EPSILON * np.maximum(np.abs(middle), typical) / STEP)[:, None]
        # The gap between the one-sided slopes is h |f''| of a smooth function: it doubles with h.
        least = 1e-4 * np.maximum(np.abs(slope), 1e-4) + 100 * rounding
        is_broken = (gap > least) & (coarse_gap < 1.5 * gap)
        # An odd jump, such as sign's, has no gap, but a slope that grows as h shrinks.
        is_broken |= np.abs(slope - coarse) > 0.2 * np.abs(slope) + 100 * rounding + 1e-6
    return Differences(slope, np.abs(slope - coarse) + rounding, is_broken)


@dataclass(frozen=True)
class Derivative:
    """A derivative as it was lowered, to be held against differences of what it derives.

    Attributes:
        function: the lowered function that gives it.
        rows: names of the m values.
        columns: names of the n directions.
        values: the values [m] after a step [n].
        stated: the derivative [m, n].
        is_hessian: whether the values are a gradient on a manifold, whose differences are symmetric
            only on average: half the sum of both orders is the second derivative along geodesics.
    """

    function: str
    rows: list[str]
    columns: list[str]
    values: Callable[[Array], Array]
    stated: Array
    is_hessian: bool = False


def faults(derivative: Derivative, where: str) -> Iterator[Finding]:
    """Entries that are not finite, lie at a kink, or differ from finite differences."""
    found = differences(derivative.values, len(derivative.columns))
    slope, uncertainty, is_broken = found.slope, found.uncertainty, found.is_broken
    if derivative.is_hessian:
        slope, uncertainty = (slope + slope.T) / 2, uncertainty + uncertainty.T
        is_broken = is_broken | is_broken.T
    stated = derivative.stated
    is_defined = np.isfinite(derivative.values(np.zeros(len(derivative.columns))))
    for row in np.flatnonzero(~is_defined).tolist():
        yield _finding("undefined", derivative, row, None, where, "its value is not finite")
    with np.errstate(all="ignore"):
        sizes = np.where(np.isfinite(slope), np.abs(slope), 0).max(axis=1, initial=0)
        allowed = TOLERANCE * sizes[:, None] + 10 * uncertainty + 1e-9
        differs = ~(np.abs(stated - slope) <= allowed)
    for row, column in np.argwhere(is_defined[:, None] & (differs | is_broken)).tolist():
        value, expected = stated[row, column], slope[row, column]
        kind: Kind = "derivative"
        text = f"it is lowered as {value:.6g}, finite differences give {expected:.6g}"
        if not np.isfinite(value):
            kind, text = "non-finite", f"the derivative is {value} where the value is finite"
        elif is_broken[row, column]:
            kind, text = "kink", f"it has a kink or jump here; CasADi's derivative is {value:.6g}"
        elif not np.isfinite(expected):
            kind, text = "undefined", "it is not defined on one side"
        yield _finding(kind, derivative, row, column, where, text)


def _finding(
    kind: Kind, derivative: Derivative, row: int, column: int | None, where: str, text: str
) -> Finding:
    name = "" if column is None else derivative.columns[column]
    return Finding(kind, derivative.function, derivative.rows[row], name, where, text)
