"""Where the payload begins in a scenario."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from palanquin.schema import Finite, NonNegative, Strict


class StartPose(Strict):
    """Where the payload begins over the ground, and how far a seed moves that."""

    x: Finite = Field(0.0, description="m")
    y: Finite = Field(0.0, description="m")
    yaw: Finite = Field(0.0, description="heading, rad")
    spread: Annotated[tuple[NonNegative, NonNegative, NonNegative], Field(strict=False)] = Field(
        (0.0, 0.0, 0.0),
        description="seeds from 1 on draw x, y and yaw uniformly within so much either way, m, rad",
    )

    def draw(self, seed: int) -> NDArray[np.float64]:
        """(x, y, yaw) [3] of a seed, m and rad; as stated for seed 0."""
        pose = np.array([self.x, self.y, self.yaw])
        if seed:
            spread = np.array(self.spread)
            pose += np.random.default_rng((seed, 1)).uniform(-spread, spread)
        return pose
