"""The way of plans to controllers: late, or lost."""

from __future__ import annotations

from typing import Generic, TypeVar

import numpy as np

T = TypeVar("T")


class PlanLink(Generic[T]):
    """Carries plans, or what controllers make of them, from a planner to controllers.

    The first one arrives at once and for sure: before it there is nothing to follow.

    Args:
        latency: physics steps from measurement to arrival.
        lost: share of plans that never arrive.
        seed: of the draw which ones.

    Attributes:
        lost: how many never arrived so far.
        oldest: the age of the oldest measurement whose plan was followed, physics steps.
    """

    def __init__(self, latency: int = 0, lost: float = 0.0, seed: int = 0) -> None:
        self._latency, self._share = latency, lost
        self._random = np.random.default_rng(seed)
        self._under_way: list[tuple[int, T]] = []
        self._current: T | None = None
        self._measured = 0
        self.lost, self.oldest = 0, 0

    def send(self, step: int, plan: T) -> None:
        """A plan for what was measured at a physics step, now."""
        if self._current is None:
            self._current, self._measured = plan, step
        elif self._random.random() < self._share:
            self.lost += 1
        else:
            self._under_way.append((step, plan))

    def at(self, step: int) -> tuple[T, int]:
        """The latest plan that has arrived at a physics step, and for how many steps no other
        one does, if any is under way. Raises LookupError before the first plan.
        """
        while self._under_way and self._under_way[0][0] + self._latency <= step:
            self._measured, self._current = self._under_way.pop(0)
        if self._current is None:
            raise LookupError("no plan has been sent yet")
        rest = self._under_way[0][0] + self._latency - step if self._under_way else _FOR_EVER
        return self._current, rest

    def follow(self, until: int) -> None:
        """Notes that the current plan was followed until a physics step."""
        self.oldest = max(self.oldest, until - self._measured)


_FOR_EVER = 2**31 - 1
