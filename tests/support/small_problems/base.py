"""What every problem of the library offers."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import palanquin as pq


@dataclass(frozen=True)
class Inputs:
    """Arguments of a solve."""

    parameters: pq.NamedArray
    measured: pq.NamedArray
    guess: pq.NamedArray

    def __iter__(self):
        return iter((self.parameters, self.measured, self.guess))


class SmallProblem(ABC):
    """A problem with its mathematics in its docstring, inputs, and a check of its solution.

    Attributes:
        has_hard_rows: some inequality is a constraint, not a penalty.
    """

    has_hard_rows = False

    @property
    def name(self) -> str:
        return type(self).__name__

    @abstractmethod
    def build(self) -> pq.Problem:
        """States the problem."""

    def inputs(self, lowered: pq.Lowered) -> Inputs:
        """Arguments of the solve that `check` judges."""
        parameters, measured, guess = lowered.parameters(), lowered.knot(), lowered.trajectory()
        self.fill(parameters, measured, guess)
        return Inputs(parameters, measured, guess)

    def fill(  # noqa: B027
        self, parameters: pq.NamedArray, measured: pq.NamedArray, guess: pq.NamedArray
    ) -> None:
        """Changes the neutral inputs to those of the problem."""

    @abstractmethod
    def check(self, plan: pq.Plan, inputs: Inputs) -> None:
        """Asserts what is known of the solution."""
