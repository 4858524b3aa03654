"""Where feet should land: below the hips, and on ground that may be stepped on.

On which side of a ditch a foot lands is a choice no gradient makes: a solver stays where its start
put the foot. So a foothold is chosen when its touchdown comes into the horizon, as it suits the
whole stance; the solver moves it within its side.
"""

from __future__ import annotations

import numpy as np

from palanquin.problems.clm.references import VELOCITY, References
from palanquin.problems.terrains import Terrain


def landings(contacts: np.ndarray, before: np.ndarray) -> np.ndarray:
    """Flags [N+1, R, 4] of feet that stand at a knot and did not at the one before.

    Args:
        contacts: flags [N+1, R, 4].
        before: feet that stand when the horizon begins, [R, 4].
    """
    standing = np.concatenate([np.asarray(before)[None], contacts]).astype(bool)
    return standing[1:] & ~standing[:-1]


def mid_stance_feet(
    references: References, landing: np.ndarray, stance: np.ndarray, terrain: Terrain
) -> np.ndarray:
    """Reference feet [N+1, R, 4, 3], m, landing below where the hip is in the middle of the stance.

    Args:
        references: reference motion.
        landing: flags of `landings`.
        stance: how long each foot stands, s, [R, 4].
        terrain: height map.
    """
    feet = references.feet()
    velocity = references.bodies[:, 1:, None, VELOCITY]
    feet[..., :2] += np.where(landing, stance / 2, 0.0)[..., None] * velocity[..., :2]
    feet[landing, 2] = terrain.height(*feet[landing, :2].T)
    return feet
