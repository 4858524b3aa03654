"""A QP without structure, and how well a point solves it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palanquin.errors import ProblemError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class KktError:
    """Residuals of the KKT conditions, each over the size of what it is made of (at least 1).

    Attributes:
        stationarity: |Px + q + C'y|.
        feasibility: |Cx - its projection onto [low, up]|.
        complementarity: the largest |y_i| times the distance of row i from the bound that y_i's
            sign names.
    """

    stationarity: float
    feasibility: float
    complementarity: float

    @property
    def max(self) -> float:
        """The largest; NaN if one is."""
        return float(np.max([self.stationarity, self.feasibility, self.complementarity]))


@dataclass(frozen=True)
class GeneralQp:
    """min 1/2 x'Px + q'x  s.t.  low <= Cx <= up, an equality where the bounds are equal.

    Attributes:
        name: of the file.
        P: [n, n], symmetric.
        q: [n].
        C: [m, n].
        low, up: [m], infinite where there is no bound.
    """

    name: str
    P: Array
    q: Array
    C: Array
    low: Array
    up: Array

    def __post_init__(self) -> None:
        n, m = self.q.size, self.low.size
        shapes = (("P", self.P, (n, n)), ("C", self.C, (m, n)), ("up", self.up, (m,)))
        for name, array, shape in shapes:
            if array.shape != shape:
                raise ProblemError(f"{self.name}: {name} is {array.shape}, but must be {shape}")
        for name, array in (("P", self.P), ("q", self.q), ("C", self.C)):
            if not np.isfinite(array).all():
                raise ProblemError(f"{self.name}: {name} is not finite")
        if np.isnan(self.low).any() or np.isnan(self.up).any():
            raise ProblemError(f"{self.name}: a bound is not a number")

    @property
    def is_equality(self) -> NDArray[np.bool_]:
        """Of the rows [m]."""
        return self.low == self.up

    def cost(self, x: Array) -> float:
        """The value 1/2 x'Px + q'x."""
        return float(0.5 * x @ self.P @ x + self.q @ x)

    def error(self, x: Array, y: Array) -> KktError:
        """Of x [n] with multipliers y [m] of Cx, positive at the upper bounds."""
        if not (np.isfinite(x).all() and np.isfinite(y).all()):
            return KktError(np.nan, np.nan, np.nan)
        rows = self.C @ x
        terms = (self.P @ x, self.q, self.C.T @ y)
        stationarity = _largest(sum(terms)) / max(1.0, *map(_largest, terms))
        feasibility = _largest(rows - np.clip(rows, self.low, self.up)) / max(1.0, _largest(rows))
        gap = np.where(y > 0, self.up - rows, rows - self.low)
        active = np.abs(y) > 0
        products = np.abs(y[active] * gap[active])
        complementarity = _largest(products) / max(1.0, abs(self.cost(x)))
        return KktError(stationarity, feasibility, complementarity)


def _largest(v: Array | float) -> float:
    return float(np.max(np.abs(v), initial=0.0))
