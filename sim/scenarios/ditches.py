"""Ditches in scenarios: lines, or some at random."""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from palanquin.schema import Finite, NonNegative, Positive, Strict

Line = tuple[float, float, float, float]
"""(a, b, c, d): the ditch along a x + b y + c = 0 is d wide, m."""


class Ditch(Strict):
    """A ditch along a x + b y + c = 0 (11)."""

    a: Finite
    b: Finite
    c: Finite
    d: Positive = Field(description="width, m")

    @model_validator(mode="after")
    def _require_direction(self) -> Self:
        if self.a == 0 and self.b == 0:
            raise ValueError("a and b are both 0; a line needs a direction")
        return self


class ListedDitches(Strict):
    """Ditches one by one."""

    type: Literal["lines"]
    lines: Annotated[tuple[Ditch, ...], Field(strict=False)]

    def draw(self, seed: int) -> list[Line]:
        """The lines [n, 4]; the seed does not matter."""
        return [(line.a, line.b, line.c, line.d) for line in self.lines]


class RandomDitches(Strict):
    """Ditches along y, one at a random place in each of `count` equal cells along x."""

    type: Literal["random"]
    count: Annotated[int, Field(ge=1, le=100)] = 12
    start: Finite = Field(1.0, description="where along x the first cell begins, m")
    spacing: Positive = Field(0.5, description="length of a cell, m")
    narrowest: Positive = Field(0.05, description="m")
    widest: Positive = Field(0.32, description="m; the paper's 0.32 unless told")
    ground: NonNegative = Field(0.08, description="at least so much ground between two, m")

    @model_validator(mode="after")
    def _require_room(self) -> Self:
        if self.narrowest > self.widest:
            raise ValueError(f"narrowest {self.narrowest} is more than widest {self.widest}")
        if self.widest + self.ground > self.spacing:
            raise ValueError(
                f"spacing {self.spacing} has no room for a ditch of {self.widest} m and "
                f"{self.ground} m of ground"
            )
        return self

    def draw(self, seed: int) -> list[Line]:
        """The lines [count, 4] that a seed gives."""
        random = np.random.default_rng(seed)
        lines: list[Line] = []
        for cell in range(self.count):
            width = random.uniform(self.narrowest, self.widest)
            slack = self.spacing - self.ground - width
            centre = self.start + cell * self.spacing + width / 2 + random.uniform(0.0, slack)
            lines.append((1.0, 0.0, -centre, width))
        return lines


Ditches = Annotated[ListedDitches | RandomDitches, Field(discriminator="type")]
