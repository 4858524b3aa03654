"""Grounds as data where feet may not stand everywhere, and height maps."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, ValidationInfo, field_validator, model_validator

from palanquin.errors import ProblemError
from palanquin.problems import foothold_courses
from palanquin.problems.foothold_areas import FootholdArea, FootholdAreas
from palanquin.problems.height_map import HeightMap
from palanquin.problems.height_map_files import SUFFIXES, read_heights
from palanquin.problems.terrains import Terrain
from palanquin.schema import Finite, NonNegative, Positive, Seed, Strict

Pair = Annotated[tuple[Finite, Finite], Field(strict=False)]
Row = Annotated[tuple[float, ...], Field(strict=False)]
Triple = Annotated[tuple[Finite, Finite, Finite], Field(strict=False)]


class RoughKind(Strict):
    """A ground that is built once, and refused with a reason if that fails."""

    is_planar: ClassVar[bool] = False

    @model_validator(mode="after")
    def _require_ground(self) -> Self:
        try:
            self._ground  # noqa: B018  (built here to be checked)
        except ProblemError as error:
            raise ValueError(str(error)) from error
        return self

    def shape(self) -> Terrain:
        """The height map."""
        return self._ground

    @cached_property
    def _ground(self) -> Terrain:
        return self.build()

    def build(self) -> Terrain:
        """The height map; raises ProblemError for numbers of which there is none."""
        raise NotImplementedError


class StairsKind(RoughKind):
    """Level ground, steps up or down along x, and level ground again."""

    type: Literal["stairs"]
    steps: Annotated[int, Field(ge=1, le=200)] = Field(6, description="number of risers")
    rise: Finite = Field(0.1, description="height of each, m; negative goes down")
    tread: Positive = Field(0.3, description="depth of each along x, m")
    start: Finite = Field(0.6, description="x of the first riser, m")
    width: Positive = Field(2.4, description="along y, about y = 0, m")
    landing: Positive = Field(4.0, description="length of the level ground at both ends, m")

    def build(self) -> Terrain:
        """The stairs."""
        return foothold_courses.stairs(
            self.steps, self.rise, self.tread, self.start, self.width, self.landing
        )


_MOST_STONES = 5000


class StonesKind(RoughKind):
    """A field of uneven stepping stones along x between two pieces of level ground."""

    type: Literal["stones"]
    seed: Seed = Field(0, description="of places, heights and headings")
    length: Positive = Field(3.0, description="of the field along x, m")
    start: Finite = Field(0.5, description="x at which it begins, m")
    width: Positive = Field(2.4, description="along y, about y = 0, m")
    pitch: Positive = Field(0.24, description="of the grid on which stones stand, m")
    size: Positive = Field(0.18, description="side of a stone, m")
    scatter: NonNegative = Field(0.02, description="of the stones' places either way, m")
    unevenness: NonNegative = Field(0.03, description="of the stones' heights either way, m")
    landing: Positive = Field(4.0, description="length of the level ground at both ends, m")

    def build(self) -> Terrain:
        """The stones."""
        count = self.length * self.width / self.pitch / self.pitch
        if count > _MOST_STONES:
            raise ProblemError(
                f"stones: {self.length:g} m x {self.width:g} m at a pitch of {self.pitch:g} m hold "
                f"{count:.3g} stones; at most {_MOST_STONES} are possible"
            )
        values = self.model_dump(exclude={"type"})
        return foothold_courses.stepping_stones(**values)


class WalkwayKind(RoughKind):
    """Planks along x between two pieces of level ground."""

    type: Literal["walkway"]
    lanes: Annotated[tuple[Finite, ...], Field(strict=False)] = Field(
        description="y of each plank's middle, m"
    )
    lane_width: Positive = Field(0.14, description="of a plank, m")
    start: Finite = Field(0.5, description="x at which they begin, m")
    length: Positive = Field(2.0, description="of the planks, m")
    width: Positive = Field(2.4, description="of the level ground along y, about y = 0, m")
    height: Finite = Field(0.0, description="of the planks over the level ground, m")
    landing: Positive = Field(4.0, description="length of the level ground at both ends, m")

    def build(self) -> Terrain:
        """The walkway."""
        return foothold_courses.walkway(**self.model_dump(exclude={"type"}))


class AreaPart(Strict):
    """A convex polygon over which the ground is a plane."""

    corners: Annotated[tuple[Pair, ...], Field(strict=False, min_length=3)] = Field(
        description="(x, y) in order, m"
    )
    plane: Triple = Field((0.0, 0.0, 0.0), description="z0, ax, ay of z = z0 + ax x + ay y")


class AreasKind(RoughKind):
    """Convex areas one by one; feet may stand nowhere else."""

    type: Literal["areas"]
    areas: Annotated[tuple[AreaPart, ...], Field(strict=False, min_length=1)]
    margin: NonNegative = Field(0.02, description="how far footholds keep from the sides, m")

    def build(self) -> Terrain:
        """The areas."""
        areas = tuple(FootholdArea(np.array(part.corners), part.plane) for part in self.areas)
        sides = max(FootholdAreas.sides, *(len(area.corners) for area in areas))
        return FootholdAreas(areas, self.margin, sides)


class HeightMapKind(RoughKind):
    """A height map from a file, or from samples in place."""

    type: Literal["height_map"]
    file: str = Field(
        "",
        description=f"one of {', '.join(SUFFIXES)}; a relative path counts from the folder of the "
        "file that names it; see `read_heights`",
    )
    heights: Annotated[tuple[Row, ...], Field(strict=False)] = Field(
        (), description="samples, m, instead of a file; a row along y holds samples along x"
    )
    origin: Pair = Field((0.0, 0.0), description="(x, y) of the first sample, m")
    spacing: Positive = Field(0.05, description="between neighbouring samples, m")
    black: Finite = Field(0.0, description="height that a picture's darkest grey stands for, m")
    white: Finite = Field(1.0, description="height that its brightest grey stands for, m")

    @field_validator("file")
    @classmethod
    def _resolve(cls, file: str, info: ValidationInfo) -> str:
        folder = Path((info.context or {}).get("folder", ""))
        return str(folder.absolute() / file) if file else ""

    def build(self) -> Terrain:
        """The map."""
        if bool(self.file) == bool(self.heights):
            raise ProblemError("height map: give either a file or heights")
        if self.file:
            samples = read_heights(Path(self.file), self.black, self.white)
        else:
            sizes = sorted({len(row) for row in self.heights})
            if len(sizes) > 1:
                raise ProblemError(f"height map: rows have {sizes} samples; all need as many")
            samples = np.array(self.heights)
        try:
            return HeightMap(samples, self.origin, self.spacing)
        except ProblemError as error:
            raise ProblemError(f"{self.file}: {error}" if self.file else str(error)) from error
