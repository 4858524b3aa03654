"""Obstacles in scenarios: boxes, walls and cylinders that stand on the ground."""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from palanquin.problems.modules import obstacles
from palanquin.schema import Finite, Positive, Strict

Point = Annotated[tuple[Finite, Finite], Field(strict=False)]
Sides = Annotated[tuple[Positive, Positive], Field(strict=False)]
Row = tuple[float, ...]
"""(x, y, yaw, half length, half width, rounding, top), as `problems.modules.Obstacles` takes it."""


class BoxObstacle(Strict):
    """An upright box."""

    type: Literal["box"]
    centre: Point = Field(description="(x, y), m")
    size: Sides = Field(description="length and width, m")
    yaw: Finite = Field(0.0, description="heading of its length, rad")
    top: Finite = Field(0.6, description="z up to which it reaches, m")

    def row(self) -> Row:
        """As the problem takes it."""
        return obstacles.box(self.centre, self.size, self.yaw, self.top)


class WallObstacle(Strict):
    """A wall between two points."""

    type: Literal["wall"]
    start: Point = Field(description="(x, y) of one end, m")
    end: Point = Field(description="(x, y) of the other, m")
    thickness: Positive = Field(0.1, description="m")
    top: Finite = Field(0.6, description="z up to which it reaches, m")

    @model_validator(mode="after")
    def _require_length(self) -> Self:
        if self.start == self.end:
            raise ValueError(f"start and end are both {list(self.start)}; a wall needs a length")
        return self

    def row(self) -> Row:
        """As the problem takes it."""
        start, end = np.array(self.start), np.array(self.end)
        along = end - start
        length, yaw = float(np.hypot(*along)), float(np.arctan2(along[1], along[0]))
        middle = ((start + end) / 2).tolist()
        return obstacles.box(middle, (length, self.thickness), yaw, self.top)


class CylinderObstacle(Strict):
    """An upright cylinder."""

    type: Literal["cylinder"]
    centre: Point = Field(description="(x, y), m")
    radius: Positive = Field(description="m")
    top: Finite = Field(0.6, description="z up to which it reaches, m")

    def row(self) -> Row:
        """As the problem takes it."""
        return obstacles.cylinder(self.centre, self.radius, self.top)


AnyObstacle = Annotated[BoxObstacle | WallObstacle | CylinderObstacle, Field(discriminator="type")]
