"""What every problem of the collection offers: its statement, and starts to solve it from."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from palanquin.lowered import Lowered
from palanquin.named_array import NamedArray
from palanquin.problem import Problem

Values = Mapping[str, Any]
"""Values by block name; whatever is not named is neutral: zeros, identity quaternions."""


@dataclass(frozen=True)
class Start:
    """Arguments of a solve: parameters [N + 1, np], measured knot [nz], guess [N + 1, nz]."""

    parameters: NamedArray
    measured: NamedArray
    guess: NamedArray

    def __iter__(self) -> Iterator[NamedArray]:
        return iter((self.parameters, self.measured, self.guess))


class Ocp(ABC):
    """An optimal control problem; a subclass' docstring has its mathematics and its source.

    Attributes:
        start: the measured knot.
        goal: where the straight line to start from ends.
        idle: values that every guess has at all knots, such as the thrust that hovers.
        spread: half-width of the random guess around the straight line.
    """

    start: ClassVar[Values] = {}
    goal: ClassVar[Values] = {}
    idle: ClassVar[Values] = {}
    spread: ClassVar[Values] = {}

    @property
    def name(self) -> str:
        """The class' name in snake case."""
        return re.sub(r"(?<!^)(?=[A-Z])", "_", type(self).__name__).lower()

    @property
    def summary(self) -> str:
        """The first sentence of the docstring."""
        return (type(self).__doc__ or "").partition("\n\n")[0].replace("\n    ", " ")

    @abstractmethod
    def build(self) -> Problem:
        """States the problem."""

    def fill(  # noqa: B027  (most problems have nothing to set)
        self, parameters: NamedArray, measured: NamedArray
    ) -> None:
        """Sets parameters that differ from their defaults, and what `start` does not say."""

    def starts(self, lowered: Lowered, random: int = 1) -> dict[str, Start]:
        """Starts by name: "rest", "line", and `random` ones, "random 0" and on.

        At rest the measured knot is held; the line leads from it to `goal`; the random ones are
        spread uniformly around the line, equally in every run.
        """
        parameters, measured = lowered.parameters(), lowered.knot()
        _assign(measured, self.start)
        self.fill(parameters, measured)
        rest = lowered.trajectory()
        rest.values[:] = measured.values
        _assign(rest, self.idle)
        line = self.line(rest)
        guesses = {"rest": rest, "line": line}
        for number in range(random):
            guesses[f"random {number}"] = self._scattered(line, number)
        return {name: Start(parameters, measured, guess) for name, guess in guesses.items()}

    def line(self, rest: NamedArray) -> NamedArray:
        """The guess that leads straight from the measured knot to `goal`."""
        line = rest.copy()
        share = np.linspace(0, 1, len(rest.values))[:, None]
        for name, value in self.goal.items():
            line[name] = (1 - share) * rest[name] + share * np.asarray(value, float)
        self._normalise(line)
        return line

    def _scattered(self, line: NamedArray, seed: int) -> NamedArray:
        rng = np.random.default_rng(seed)
        guess = line.copy()
        for name, width in self.spread.items():
            guess[name] = line[name] + width * rng.uniform(-1, 1, line[name].shape)
        self._normalise(guess)
        return guess

    def _normalise(self, guess: NamedArray) -> None:
        for block in self.build().blocks:
            if block.is_quaternion:
                q = guess[block.name]
                guess[block.name] = q / np.linalg.norm(q, axis=1, keepdims=True)


def _assign(array: NamedArray, values: Values) -> None:
    for name, value in values.items():
        array[name] = value
