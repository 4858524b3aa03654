"""Arrays that grow by a row a tick."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palanquin.sim.errors import InputError

_FIRST_ROWS = 256


class GrowingArrays:
    """Arrays of numbers by name, of one row a tick; memory is taken ahead, doubled as need be.

    Args:
        what: they are, for messages.
        shapes: of a row, by name.
    """

    def __init__(self, what: str, shapes: Mapping[str, tuple[int, ...]]) -> None:
        self._what, self._shapes = what, dict(shapes)
        self._arrays = {name: np.empty((_FIRST_ROWS, *shape)) for name, shape in shapes.items()}
        self._rows, self._room = 0, _FIRST_ROWS

    def __len__(self) -> int:
        return self._rows

    def check(self, row: Mapping[str, Any]) -> None:
        """Raises InputError for a missing, unknown or misshapen value."""
        if row.keys() != self._shapes.keys():
            missing = sorted(self._shapes.keys() - row.keys())
            unknown = sorted(row.keys() - self._shapes.keys())
            raise InputError(f"record {self._what}: missing {missing}, unknown {unknown}")
        for name, shape in self._shapes.items():
            if getattr(row[name], "shape", None) != shape and np.shape(row[name]) != shape:
                found = np.shape(row[name])
                raise InputError(f"record.{name}: shape {found} instead of {shape}")

    def append(self, row: Mapping[str, Any]) -> None:
        """Adds a row that was checked."""
        if self._rows == self._room:
            self._grow()
        for name, array in self._arrays.items():
            array[self._rows] = row[name]
        self._rows += 1

    def arrays(self) -> dict[str, NDArray[np.float64]]:
        """All rows so far, by name."""
        return {name: array[: self._rows].copy() for name, array in self._arrays.items()}

    def _grow(self) -> None:
        self._room *= 2
        for name, array in self._arrays.items():
            grown = np.empty((self._room, *self._shapes[name]))
            grown[: self._rows] = array
            self._arrays[name] = grown
