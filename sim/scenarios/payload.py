"""The payload in scenarios: mass, shape, inertia, height."""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from palanquin.problems import clm
from palanquin.schema import Positive, Strict
from palanquin.sim.scenarios import team
from palanquin.sim.scenarios.vectors import PositiveVector

Extents = tuple[float, float, float]


class Box(Strict):
    """A box, its edges along the payload's axes."""

    type: Literal["box"]
    size: PositiveVector = Field(description="edges along x, y and z, m")

    @property
    def extents(self) -> Extents:
        """Of the box around it, m."""
        return self.size

    def moments(self, mass: float) -> Extents:
        """Principal moments of inertia at uniform density, kg m^2."""
        squares = np.square(self.size)
        return tuple((mass / 12 * (squares.sum() - squares)).tolist())

    def in_scene(self, mass: float) -> team.Payload:
        """As the scene shows it."""
        return team.Payload(mass, self.size)


class Cylinder(Strict):
    """A cylinder along one of the payload's axes."""

    type: Literal["cylinder"]
    radius: Positive = Field(description="m")
    length: Positive = Field(description="m")
    axis: Literal["x", "y", "z"] = Field("y", description="of the payload's frame")

    @property
    def extents(self) -> Extents:
        """Of the box around it, m."""
        sides = [2 * self.radius] * 3
        sides["xyz".index(self.axis)] = self.length
        return (sides[0], sides[1], sides[2])

    def moments(self, mass: float) -> Extents:
        """Principal moments of inertia at uniform density, kg m^2."""
        across = mass / 12 * (3 * self.radius**2 + self.length**2)
        moments = [across] * 3
        moments["xyz".index(self.axis)] = mass / 2 * self.radius**2
        return (moments[0], moments[1], moments[2])

    def in_scene(self, mass: float) -> team.Payload:
        """As the scene shows it."""
        return team.Payload(mass, self.extents, axis=self.axis)


Shape = Annotated[Box | Cylinder, Field(discriminator="type")]


class Payload(Strict):
    """What the team carries."""

    mass: Positive = Field(16.0, description="kg")
    shape: Shape = Field(
        Box(type="box", size=(0.08, 2.0, 0.08)), description="centred at the centre of mass"
    )
    inertia: PositiveVector | None = Field(
        None,
        description="moments about the payload's axes that the planner uses, kg m^2; of the shape "
        "at uniform density unless told",
    )
    allow_unphysical: bool = Field(
        False, description="whether the moments may break the triangle inequality, as Table I's do"
    )
    height: Positive = Field(0.47, description="of the centre of mass over the ground, m")

    @model_validator(mode="after")
    def _require_physical(self) -> Self:
        largest, rest = max(self.moments), sum(self.moments) - max(self.moments)
        if largest > rest * (1 + 1e-9) and not self.allow_unphysical:
            raise ValueError(
                f"inertia {list(self.moments)} belongs to no rigid body: {largest:g} is more than "
                f"the other two together, {rest:g}; set `allow_unphysical: true` to plan with it "
                "all the same"
            )
        return self

    @property
    def moments(self) -> Extents:
        """Principal moments of inertia for the planner, kg m^2."""
        return self.inertia or self.shape.moments(self.mass)

    def carried(self) -> clm.Payload:
        """The payload as the planner knows it."""
        return clm.Payload(self.mass, self.moments, self.height)
