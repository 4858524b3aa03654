"""Vectors and names in scenario files."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field, StringConstraints

from palanquin.schema import Finite, Positive

LONGEST_NAME = 40

Name = Annotated[
    str, StringConstraints(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$", max_length=LONGEST_NAME)
]
"""Of a scenario or robot: it becomes a part of paths in recordings and of file names."""

# A list in a file, a tuple in Python; the entries themselves stay strict.
Vector = Annotated[tuple[Finite, Finite, Finite], Field(strict=False)]
PositiveVector = Annotated[tuple[Positive, Positive, Positive], Field(strict=False)]


def _require_non_zero(vector: tuple[float, ...]) -> tuple[float, ...]:
    if not any(vector):
        raise ValueError("is 0 along every axis")
    return vector


NonZeroVector = Annotated[Vector, AfterValidator(_require_non_zero)]
