"""Random courses of ditches along y, as in section IV-B of De Vincenti and Coros."""

from __future__ import annotations

import numpy as np

from palanquin.errors import ProblemError
from palanquin.problems import checks

NARROWEST = 0.08
"""Width of the narrowest random ditch, m."""

STANDING_ROOM = (0.26, 0.7)
"""Ground between the edges of two neighbouring ditches, m: at least room for a step."""


def random_ditches(
    seed: int, count: int = 12, widest: float = 0.32, first: float = 0.6
) -> np.ndarray:
    """Lines (a, b, c, d) of ditches along y, [count, 4], a x + b y + c = 0, width d, m.

    Walking along x one meets ditches whose widths are uniform from `NARROWEST` to `widest` and,
    between each and the next, standing room that is uniform within `STANDING_ROOM`. The first
    begins at x = `first`. The same seed gives the same course, and a longer course begins as a
    shorter one does.

    Raises:
        ProblemError: the seed is negative, there is less than one ditch, or `widest` is under
            `NARROWEST`.
    """
    if seed < 0 or count < 1:
        raise ProblemError(f"ditches: seed {seed} must be at least 0 and count {count} at least 1")
    if checks.positive("ditches: widest", widest) < NARROWEST:
        raise ProblemError(f"ditches: widest is {widest} m; it must be at least {NARROWEST} m")
    checks.finite("ditches: first", first)
    draws = np.random.default_rng(seed).random((count, 2))
    widths = NARROWEST + draws[:, 0] * (widest - NARROWEST)
    rooms = STANDING_ROOM[0] + draws[:, 1] * (STANDING_ROOM[1] - STANDING_ROOM[0])
    starts = first + np.concatenate([[0.0], np.cumsum(widths + rooms)[:-1]])
    ones = np.ones(count)
    return np.column_stack([ones, 0 * ones, -(starts + widths / 2), widths])
