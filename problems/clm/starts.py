"""Starting points that differ in where feet land: choices that no gradient makes.

On which side of a ditch a foot lands, or on which stone, is combinatorial. A start is a trajectory
of all feet; what the ground is like around its footholds follows from it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from palanquin import _core
from palanquin.problems.terrains import Terrain


def foothold_starts(
    wanted: np.ndarray,
    contacts: np.ndarray,
    before: np.ndarray,
    terrain: Terrain,
    ditches: np.ndarray,
    at_most: int,
) -> list[np.ndarray]:
    """Wanted foot positions with other choices of footholds, at most so many.

    Each takes every landing foot to one of the places that the terrain offers, or to one of the two
    ways out of a ditch. They come in the order of the sum of squared distances from the wanted
    footholds.

    Args:
        wanted: positions in the world, m, [N+1, R, 4, 3].
        contacts: flags [N+1, R, 4].
        before: feet that stand when the horizon begins, [R, 4].
        terrain: the ground.
        ditches: lines (a, b, c, d) on it, [n, 4], m.
        at_most: number of starts, at least 1.
    """
    n = len(wanted)
    flags, standing = (np.asarray(a, dtype=bool) for a in (contacts, before))
    starts = _core.foothold_starts(
        wanted.reshape(n, -1),
        flags.reshape(n, -1),
        standing.reshape(1, -1),
        _core.StandingGround(terrain.core, ditches),
        at_most,
    )
    return [start.reshape(wanted.shape) for start in starts]


def cheapest_combinations(costs: Sequence[np.ndarray], at_most: int) -> list[tuple[int, ...]]:
    """One index into each of `costs` ([n_i], 1 <= n_i <= 12), in the order of the sum of what they
    cost; at most so many, none twice.
    """
    found = _core.cheapest_combinations([list(cost) for cost in costs], at_most)
    return [tuple(picked) for picked in found]
