"""Ground for the bar carriers: flat, rough or covered with blocks, slippery or soft."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from palanquin.schema import StrictData
from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.limits import require_number, require_seed

Array = NDArray[np.float64]

KINDS = ("flat", "rough", "blocks")
LENGTH, WIDTH = 16.0, 7.0
"""Of the ground, m: from 2 m behind the start to 14 m ahead of it."""

BEHIND = 2.0
CLEAR = 0.6
"""Radius around the start without roughness, m."""

_CELL = 0.25
_SPACING = 0.05


@dataclass(frozen=True)
class Ground(StrictData):
    """What the robots walk on, blindly."""

    kind: Annotated[
        Literal["flat", "rough", "blocks"],
        Field(description="a plane, a random height field, or boxes strewn at random"),
    ] = "flat"
    height: Annotated[float, Field(description="of the roughest spots, m")] = 0.05
    friction: Annotated[float, Field(description="between feet and ground")] = 0.6
    step: Annotated[float, Field(description="of the left half (y > 0) over the other, m")] = 0.0
    softness: Annotated[
        float, Field(description="time constant of the contact, s; 0.005 is hard, 0.03 gives a cm")
    ] = 0.005
    seed: Annotated[int, Field(description="of roughness and blocks")] = 0

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(f"ground.kind: {self.kind!r} is not one of {', '.join(KINDS)}")
        require_number("ground.height", self.height, 1e-3, 0.3, "m")
        require_number("ground.friction", self.friction, 0.05, 2.0)
        require_number("ground.step", self.step, 0.0, 0.3, "m")
        require_number("ground.softness", self.softness, 0.003, 0.1, "s")
        require_seed("ground.seed", self.seed)

    def heights(self) -> Array:
        """Heights [rows, columns], rows along y: random every 0.25 m, bilinear between, 0 at the
        start.
        """
        random = np.random.default_rng(self.seed)
        coarse = random.uniform(
            0, self.height, (round(WIDTH / _CELL) + 1, round(LENGTH / _CELL) + 1)
        )
        x = np.linspace(-BEHIND, LENGTH - BEHIND, round(LENGTH / _SPACING) + 1)
        y = np.linspace(-WIDTH / 2, WIDTH / 2, round(WIDTH / _SPACING) + 1)
        along = np.array(
            [np.interp(x + BEHIND, _CELL * np.arange(row.size), row) for row in coarse]
        )
        columns = [np.interp(y + WIDTH / 2, _CELL * np.arange(c.size), c) for c in along.T]
        fade = np.clip((np.abs(x) - CLEAR) / 0.5, 0, 1)
        return np.array(columns).T * fade
