"""Terrains as data: what planning cases, scenarios and recorded runs may name as their ground.

A new kind is a class with a `type` of its own, listed in `TerrainKind`.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from palanquin.problems import terrains
from palanquin.problems.rough_kinds import (
    AreasKind,
    HeightMapKind,
    StairsKind,
    StonesKind,
    WalkwayKind,
)
from palanquin.schema import Finite, Positive, Strict


class FlatKind(Strict):
    """Level ground."""

    is_planar: ClassVar[bool] = True
    type: Literal["flat"]
    z0: Finite = Field(0.0, description="height, m")

    def shape(self) -> terrains.Terrain:
        """The height map."""
        return terrains.Flat(self.z0)


class PlaneKind(Strict):
    """An inclined plane z0 + ax x + ay y."""

    is_planar: ClassVar[bool] = True
    type: Literal["plane"]
    z0: Finite = Field(description="height at the origin, m")
    ax: Finite = Field(description="slope along x, m/m")
    ay: Finite = Field(description="slope along y, m/m")

    def shape(self) -> terrains.Terrain:
        """The height map."""
        return terrains.Plane(self.z0, self.ax, self.ay)


class RampKind(Strict):
    """The logistic ramp (17) of De Vincenti and Coros, which climbs along x."""

    is_planar: ClassVar[bool] = False
    type: Literal["ramp"]
    H: Positive = Field(description="height of the upper level over the lower, m")
    kappa: Finite = Field(description="largest slope, m/m; negative descends")
    xg: Finite = Field(description="where the slope is largest, m")

    def shape(self) -> terrains.Terrain:
        """The height map."""
        return terrains.Ramp(self.H, self.kappa, self.xg)


TerrainKind = Annotated[
    FlatKind
    | PlaneKind
    | RampKind
    | StairsKind
    | StonesKind
    | WalkwayKind
    | AreasKind
    | HeightMapKind,
    Field(discriminator="type"),
]
