"""Starting points for ditches: on which side of each a foot lands is a choice no gradient makes."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, combinations, islice

import numpy as np

from palanquin.problems.terrains import Terrain

# Distance from the edge at which a start puts a foot, m.
_MARGIN = 0.01


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
    stands = np.concatenate([np.asarray(before)[None], contacts]).astype(bool)
    landings = np.argwhere(stands[1:] & ~stands[:-1])
    inside = [tuple(at) for at in landings if _depths(wanted[tuple(at)], lines).max(initial=0) > 0]
    starts = [wanted]
    if not inside:
        return starts
    for flipped in islice(_subsets(len(inside)), at_most - 1):
        start = np.array(wanted)
        for n, at in enumerate(inside):
            start[at][:2] = _leave(wanted[at][:2], lines, nearer=n not in flipped)
            start[at][2] = terrain.height(*start[at][:2])
        starts.append(start)
    return starts


def _subsets(n: int) -> Iterator[tuple[int, ...]]:
    """Subsets of range(n), small ones first."""
    return chain.from_iterable(combinations(range(n), size) for size in range(n + 1))


def _depths(xy: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """Depth of a point inside each ditch (11), m; negative outside."""
    return lines[:, 3] / 2 - np.abs(_offsets(xy, lines))


def _offsets(xy: np.ndarray, lines: np.ndarray) -> np.ndarray:
    """Signed distance of a point from each ditch's centre line, m."""
    distance = lines[:, :2] @ xy[:2] + lines[:, 2]
    return np.divide(distance, np.hypot(lines[:, 0], lines[:, 1]))


def _leave(xy: np.ndarray, lines: np.ndarray, nearer: bool) -> np.ndarray:
    """Moves a point out of its deepest ditch, and in the same direction on out of further ones."""
    direction = np.zeros(2)
    for _ in range(len(lines)):
        depths = _depths(xy, lines)
        j = int(depths.argmax())
        if depths[j] <= 0:
            break
        offset = _offsets(xy, lines)[j]
        normal = lines[j, :2] / np.linalg.norm(lines[j, :2])
        if not direction.any():
            direction = normal if (offset >= 0) == nearer else -normal
        side = 1.0 if normal @ direction >= 0 else -1.0
        xy = xy + (side * (lines[j, 3] / 2 + _MARGIN) - offset) * normal
    return xy
