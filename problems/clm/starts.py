"""Starting points that differ in where feet land: choices that no gradient makes.

On which side of a ditch a foot lands, or on which stone, is combinatorial. A start is a trajectory
of all feet; what the ground is like around its footholds follows from it.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator
from itertools import islice

import numpy as np

from palanquin.problems.clm.landing import landings

Options = Callable[[np.ndarray], np.ndarray]
"""Footholds [n, 3] to choose from, given the wanted one [3] in the world, m; the best first."""


def foothold_starts(
    wanted: np.ndarray,
    contacts: np.ndarray,
    before: np.ndarray,
    options: Options,
    at_most: int,
) -> list[np.ndarray]:
    """Wanted foot positions with other choices of footholds, at most so many.

    Each takes every landing foot to one of its options. They come in the order of the sum of
    squared distances from the wanted footholds.

    Args:
        wanted: positions in the world, m, [N+1, R, 4, 3].
        contacts: flags [N+1, R, 4].
        before: feet that stand when the horizon begins, [R, 4].
        options: of a foothold.
        at_most: number of starts, at least 1.
    """
    touchdowns = [tuple(at) for at in np.argwhere(landings(contacts, before))]
    choices = [options(wanted[at]) for at in touchdowns]
    costs = [
        ((choice - wanted[at]) ** 2).sum(axis=-1)
        for at, choice in zip(touchdowns, choices, strict=True)
    ]
    starts = []
    for picked in islice(cheapest_combinations(costs), at_most):
        start = np.array(wanted)
        for at, choice, index in zip(touchdowns, choices, picked, strict=True):
            start[at] = choice[index]
        starts.append(start)
    return starts


def cheapest_combinations(costs: list[np.ndarray]) -> Iterator[tuple[int, ...]]:
    """One index into each of `costs` ([n_i], n_i >= 1), in the order of the sum of what they cost.

    Combinations grow from the cheapest one as a tree: each raises, in its own sorted order, one
    position at or after the one that its parent raised, so none comes twice.
    """
    orders = [np.argsort(cost, kind="stable") for cost in costs]
    steps = [np.sort(cost) - np.min(cost) for cost in costs]
    heap: list[tuple[float, tuple[int, ...], int]] = [(0.0, (0,) * len(costs), 0)]
    while heap:
        total, ranks, first = heapq.heappop(heap)
        yield tuple(int(order[rank]) for order, rank in zip(orders, ranks, strict=True))
        for i in range(first, len(costs)):
            if ranks[i] + 1 < len(costs[i]):
                raised = (*ranks[:i], ranks[i] + 1, *ranks[i + 1 :])
                more = steps[i][ranks[i] + 1] - steps[i][ranks[i]]
                heapq.heappush(heap, (total + more, raised, i))
