"""How an inequality row h <= 0 enters a problem: three penalties, or a hard constraint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from palanquin.errors import ProblemError


@dataclass(frozen=True)
class Policy:
    """Base of the policies; `kind` is the code that the engine knows (`PolicyKind` in C++), `word`
    its name in manifests.
    """

    kind: ClassVar[int]
    word: ClassVar[str]

    def coefficients(self) -> tuple[float, float]:
        """Stiffness and smoothing as the engine takes them."""
        raise NotImplementedError


def _require_positive(policy: Policy, **values: float) -> None:
    for field, value in values.items():
        if not 0.0 < value < float("inf"):
            raise ProblemError(
                f"{type(policy).__name__}.{field} is {value}; it must be positive and finite"
            )


@dataclass(frozen=True)
class Penalty(Policy):
    """Twice continuously differentiable penalty (De Vincenti and Coros, eq. 15).

    S(h) = K (h^2 + eps^2 / 3) for h >= eps, 0 for h <= -eps, and
    K (h^3 / (6 eps) + h^2 / 2 + eps h / 2 + eps^2 / 6) between. The paper prints the middle branch
    with the signs of its odd terms reversed, which makes it discontinuous.

    Attributes:
        stiffness: K, cost per squared unit of the row.
        smoothing: eps, half-width of the blend, in the row's unit.
    """

    kind: ClassVar[int] = 1
    word: ClassVar[str] = "c2_penalty"
    stiffness: float = 420.0
    smoothing: float = 1e-3

    def __post_init__(self) -> None:
        _require_positive(self, stiffness=self.stiffness, smoothing=self.smoothing)

    def coefficients(self) -> tuple[float, float]:  # noqa: D102
        return self.stiffness, self.smoothing


@dataclass(frozen=True)
class SquaredHinge(Policy):
    """S(h) = K max(h, 0)^2; `stiffness` is K, cost per squared unit of the row."""

    kind: ClassVar[int] = 2
    word: ClassVar[str] = "squared_hinge"
    stiffness: float = 420.0

    def __post_init__(self) -> None:
        _require_positive(self, stiffness=self.stiffness)

    def coefficients(self) -> tuple[float, float]:  # noqa: D102
        return self.stiffness, 0.0


@dataclass(frozen=True)
class RelaxedBarrier(Policy):
    """S(h) = -mu log(-h) for h <= -delta, continued as a quadratic with matching curvature.

    Attributes:
        weight: mu.
        relaxation: delta, distance to the boundary where the quadratic begins, in the row's unit.
    """

    kind: ClassVar[int] = 3
    word: ClassVar[str] = "relaxed_barrier"
    weight: float = 0.1
    relaxation: float = 0.01

    def __post_init__(self) -> None:
        _require_positive(self, weight=self.weight, relaxation=self.relaxation)

    def coefficients(self) -> tuple[float, float]:  # noqa: D102
        return self.weight, self.relaxation


@dataclass(frozen=True)
class Hard(Policy):
    """The row stays a constraint, for a back end that takes inequalities (structured, OSQP)."""

    kind: ClassVar[int] = 0
    word: ClassVar[str] = "hard"

    def coefficients(self) -> tuple[float, float]:  # noqa: D102
        return 0.0, 0.0


@dataclass(frozen=True)
class Slack(Policy):
    """A hard row h <= s over a slack s >= 0 of its own, at the price l1 s + l2 s^2.

    With l1 above the row's multiplier the row holds exactly where it can; without l1 it is the
    same as `SquaredHinge(l2)`, and lowered as such. With l1 the engine knows hard rows over a block
    NAME.slack, so that `set_policy` cannot change the prices.

    Attributes:
        l1: price per unit of the row, not negative.
        l2: price per squared unit, not negative; one of both is positive.
    """

    kind: ClassVar[int] = -1
    word: ClassVar[str] = "slack"
    l1: float = 0.0
    l2: float = 0.0

    def __post_init__(self) -> None:
        for field, value in (("l1", self.l1), ("l2", self.l2)):
            if not 0.0 <= value < float("inf"):
                raise ProblemError(f"Slack.{field} is {value}; it must be finite and not negative")
        if self.l1 == self.l2 == 0.0:
            raise ProblemError("Slack: l1 or l2 must be positive")

    def coefficients(self) -> tuple[float, float]:  # noqa: D102
        raise ProblemError("a slack is stated with its rows; set_policy cannot make one")


def policy_of(kind: int, stiffness: float, smoothing: float) -> Policy:
    """The policy that the engine knows by these numbers: the inverse of `coefficients`."""
    if kind == Penalty.kind:
        return Penalty(stiffness, smoothing)
    if kind == SquaredHinge.kind:
        return SquaredHinge(stiffness)
    return RelaxedBarrier(stiffness, smoothing) if kind == RelaxedBarrier.kind else Hard()
