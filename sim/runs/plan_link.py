"""The way of plans to controllers: late, or lost."""

from __future__ import annotations

from collections.abc import Callable
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
        self._disturbances: list[tuple[int, bool]] = []
        self._under_way: list[tuple[int, int, T]] = []
        self._current: T | None = None
        self._measured = 0
        self.lost, self.oldest = 0, 0

    def send(self, step: int, plan: T) -> None:
        """A plan for what was measured at a physics step, now."""
        if self._current is None:
            self._current, self._measured = plan, step
        elif self._random.random() < self._share or any(lost for _, lost in self._disturbances):
            self.lost += 1
        else:
            delay = self._latency + sum(more for more, _ in self._disturbances)
            self._under_way.append((step + delay, step, plan))

    def disturb(self, delay: int = 0, is_silent: bool = False) -> Callable[[], None]:
        """Plans sent from now on take `delay` physics steps more, or never arrive, whatever else
        disturbs; returns what mends it.
        """
        self._disturbances.append((delay, is_silent))
        return lambda: self._disturbances.remove((delay, is_silent))

    def at(self, step: int) -> tuple[T, int]:
        """The latest plan that has arrived at a physics step, and for how many steps no other
        one does, if any is under way; one that a later one has overtaken is of no use any more.
        Raises LookupError before the first plan.
        """
        for arrival, measured, plan in self._under_way:
            if arrival <= step and measured > self._measured:
                self._measured, self._current = measured, plan
        self._under_way = [part for part in self._under_way if part[0] > step]
        if self._current is None:
            raise LookupError("no plan has been sent yet")
        next_arrival = min((arrival for arrival, *_ in self._under_way), default=_FOR_EVER)
        return self._current, next_arrival - step

    def follow(self, until: int) -> None:
        """Notes that the current plan was followed until a physics step."""
        self.oldest = max(self.oldest, until - self._measured)


_FOR_EVER = 2**31 - 1
