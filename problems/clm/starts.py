"""Starting points for ditches: on which side of each a foot lands is a choice no gradient makes."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, combinations, islice

import numpy as np

from palanquin.problems.clm.clear_ground import ditch_depths, leave_ditches
from palanquin.problems.clm.landing import landings
from palanquin.problems.terrains import Terrain


def foothold_starts(
    wanted: np.ndarray,
    contacts: np.ndarray,
    before: np.ndarray,
    lines: np.ndarray,
    terrain: Terrain,
    at_most: int,
) -> list[np.ndarray]:
    """Wanted foot positions with different sides of the ditches chosen, at most so many.

    The first is `wanted` itself. The second takes every foot that would land in a ditch to the
    nearer edge; the next ones take one of them to the other edge, then two, and so on.

    Args:
        wanted: positions in the world, m, [N+1, R, 4, 3].
        contacts: flags [N+1, R, 4].
        before: feet that stand when the horizon begins, [R, 4].
        lines: ditches (a, b, c, d), [n, 4].
        terrain: height map, for the moved feet.
        at_most: number of starts, at least 1.
    """
    deepest = ditch_depths(wanted[..., :2], lines).max(axis=-1, initial=0)
    inside = [tuple(at) for at in np.argwhere(landings(contacts, before) & (deepest > 0))]
    starts = [wanted]
    if not inside:
        return starts
    for flipped in islice(_subsets(len(inside)), at_most - 1):
        start = np.array(wanted)
        for n, at in enumerate(inside):
            start[at][:2] = leave_ditches(wanted[at][None, :2], lines, nearer=n not in flipped)[0]
            start[at][2] = terrain.height(*start[at][:2])
        starts.append(start)
    return starts


def _subsets(n: int) -> Iterator[tuple[int, ...]]:
    """Subsets of range(n), small ones first."""
    return chain.from_iterable(combinations(range(n), size) for size in range(n + 1))
