"""Several starting points solved side by side, of which the best plan is kept.

Which side of a ditch a foot takes is a choice that no gradient makes: a solver stays where its
start put it. At a fraction of a millisecond a solve, trying a few starts costs little.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palanquin import _core
from palanquin.errors import ProblemError
from palanquin.lowered import Lowered
from palanquin.named_array import NamedArray
from palanquin.plan import Plan, Sqp
from palanquin.policies import Policy


@dataclass(frozen=True)
class Choice:
    """Outcome of solving from several starts: the best plan, its start's index, and all plans."""

    plan: Plan
    index: int
    plans: tuple[Plan, ...]


class Candidates:
    """Up to `at_most` SQP solvers of one problem that work at the same time.

    Each keeps its own workspace. Which solver takes which start is fixed, so results do not depend
    on timing.

    Args:
        lowered: the problem.
        at_most: how many starts a call of `solve` may have.
        threads: how many are solved at once.
        horizon: number of intervals; the problem's own unless told.
        **options: as of `Sqp`.

    Raises:
        ProblemError: `at_most` or `threads` below 1, or an unknown option.
    """

    def __init__(
        self,
        lowered: Lowered,
        at_most: int,
        threads: int = 2,
        horizon: int | None = None,
        **options: Any,
    ) -> None:
        for name, value in (("at_most", at_most), ("threads", threads)):
            if value < 1:
                raise ProblemError(f"candidates: {name} is {value}; at least 1 is needed")
        self.solvers = [Sqp(lowered, horizon=horizon, **options) for _ in range(at_most)]
        self._threads = threads

    @cached_property
    def _core(self) -> _core.Candidates:
        return _core.Candidates([solver._core for solver in self.solvers], self._threads)

    def set_policy(self, family: str, policy: Policy) -> None:
        """As `Sqp.set_policy`, for all solvers."""
        for solver in self.solvers:
            solver.set_policy(family, policy)

    def solve(
        self,
        parameters: NamedArray | NDArray[np.float64] | Sequence[NamedArray | ArrayLike],
        measured: NamedArray | ArrayLike,
        guesses: Sequence[NamedArray | ArrayLike],
    ) -> Choice:
        """Solves from every guess and keeps the plan of lowest cost among the usable ones.

        Equality residuals count with a weight, since a plan after few iterations may have some.

        Args:
            parameters: of all starts, or of each: what surrounds a foothold depends on the choice.
            measured: as of `Sqp.solve`.
            guesses: where to start, at least one and at most `at_most`.

        Raises:
            ProblemError: too many or no guesses, or not as many parameters. What a solve raises is
                raised when all have ended.
        """
        if not 1 <= len(guesses) <= len(self.solvers):
            raise ProblemError(
                f"candidates: {len(guesses)} guesses; 1 to {len(self.solvers)} are needed"
            )
        sets: list[Any]
        if isinstance(parameters, (NamedArray, np.ndarray)) and np.ndim(parameters) == 2:
            sets = [parameters] * len(guesses)
        else:
            sets = list(parameters)
        if len(sets) != len(guesses):
            raise ProblemError(
                f"candidates: {len(sets)} sets of parameters for {len(guesses)} guesses"
            )
        jobs = [
            solver._inputs(values, measured, guess)
            for solver, values, guess in zip(self.solvers, sets, guesses, strict=False)
        ]
        index = self._core.solve([p for p, _, _ in jobs], jobs[0][1], [g for _, _, g in jobs])
        plans = tuple(
            solver.answered(z, start)
            for solver, (_, z, start) in zip(self.solvers, jobs, strict=False)
        )
        return Choice(plans[index], index, plans)
