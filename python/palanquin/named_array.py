"""Arrays whose columns have names."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from palanquin.errors import ProblemError


class NamedArray:
    """A [knots, n] array whose columns have names; `a["name"]` is a [knots, ...] view."""

    def __init__(
        self,
        what: str,
        values: NDArray[np.float64],
        columns: dict[str, tuple[slice, tuple[int, ...]]],
    ) -> None:
        self._what = what
        self._values = values
        self._columns = columns
        self._views: dict[str, NDArray[np.float64]] = {}

    @property
    def values(self) -> NDArray[np.float64]:
        """The whole array."""
        return self._values

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        view = self._views.get(name)
        if view is None:
            columns, shape = self._find(name)
            view = self._values[..., columns].reshape(*self._values.shape[:-1], *shape)
            self._views[name] = view
        return view

    def __setitem__(self, name: str, value: ArrayLike) -> None:
        target = self[name]
        array = np.asarray(value, dtype=float)
        if not np.isfinite(array).all():
            raise ProblemError(f"{self._what} '{name}' holds a value that is not finite")
        try:
            target[...] = array
        except ValueError:
            raise ProblemError(
                f"{self._what} '{name}' has shape {array.shape}; it must broadcast to "
                f"{target.shape}"
            ) from None

    def __array__(
        self, dtype: DTypeLike | None = None, copy: bool | None = None
    ) -> NDArray[np.float64]:
        """`np.asarray(a)` is the whole array."""
        return np.array(self._values, dtype=dtype, copy=copy)

    def __contains__(self, name: str) -> bool:
        return name in self._columns

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __reduce__(self) -> tuple[type[NamedArray], tuple[object, ...]]:
        """Pickled and deep copies make views of their own."""
        return NamedArray, (self._what, self._values, self._columns)

    def copy(self) -> NamedArray:
        """An independent copy."""
        return NamedArray(self._what, self.values.copy(), self._columns)

    def over(self, values: NDArray[np.float64]) -> NamedArray:
        """The same names over another array of this shape, which it writes to."""
        return NamedArray(self._what, values, self._columns)

    def _find(self, name: str) -> tuple[slice, tuple[int, ...]]:
        try:
            return self._columns[name]
        except KeyError:
            raise ProblemError(
                f"there is no {self._what} '{name}'; there are {', '.join(self._columns)}"
            ) from None
