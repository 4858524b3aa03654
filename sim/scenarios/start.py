"""Where a run begins: standing nominally, or near it at random."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from palanquin.problems import quaternions
from palanquin.problems.clm.references import ORIENTATION, POSITION, VELOCITY
from palanquin.problems.clm.team_plan import TeamState
from palanquin.problems.terrains import Terrain
from palanquin.sim.errors import InputError

POSITION_SPREAD = 0.02
"""Of bodies, and of feet along the ground, m."""

ROTATION_SPREAD = 0.03
"""Of bodies about each axis, rad."""

VELOCITY_SPREAD = 0.05
"""Of bodies along each axis, m/s."""


def disturbed(state: TeamState, terrain: Terrain, seed: int) -> TeamState:
    """`state` itself for seed 0, else moved by what the seed draws, uniformly within the spreads.

    Feet stay on the ground. Raises InputError for a negative seed.
    """
    if seed < 0:
        raise InputError(f"seed: {seed} must be at least 0")
    if seed == 0:
        return state
    random = np.random.default_rng(seed)

    def draw(spread: float, shape: tuple[int, ...]) -> np.ndarray:
        return random.uniform(-spread, spread, shape)

    bodies, feet = state.bodies.copy(), state.feet.copy()
    shape = (len(bodies), 3)
    turn = quaternions.from_rotation_vector(draw(ROTATION_SPREAD, shape))
    bodies[:, POSITION] += draw(POSITION_SPREAD, shape)
    bodies[:, ORIENTATION] = quaternions.multiply(bodies[:, ORIENTATION], turn)
    bodies[:, VELOCITY] += draw(VELOCITY_SPREAD, shape)
    feet[..., :2] += draw(POSITION_SPREAD, feet[..., :2].shape)
    feet[..., 2] = terrain.height(feet[..., 0], feet[..., 1])
    return replace(state, bodies=bodies, feet=feet)
