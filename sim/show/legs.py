"""How far a team's legs are stretched, against their limits (8a) of De Vincenti and Coros."""

from __future__ import annotations

import numpy as np

from palanquin.problems import clm, quaternions
from palanquin.problems.clm.references import ORIENTATION, POSITION


def leg_lengths(team: clm.Team, bodies: np.ndarray, feet: np.ndarray) -> np.ndarray:
    """Distances from hips to feet, m, [..., R, 4].

    Args:
        team: payload and robots.
        bodies: states [..., R+1, 13].
        feet: in the world, m, [..., R, 4, 3].
    """
    robots = bodies[..., 1:, None, :]
    hips = robots[..., POSITION] + quaternions.rotate(robots[..., ORIENTATION], team.hips())
    return np.linalg.norm(feet - hips, axis=-1)


def leg_limits(team: clm.Team) -> np.ndarray:
    """Reaches l_f of the robots' legs, m, [R]."""
    return np.array([carrier.model.leg_length for carrier in team.carriers])
