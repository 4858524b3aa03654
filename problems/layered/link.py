"""The links that carry what distributed planners tell each other."""

from __future__ import annotations

from dataclasses import dataclass

from palanquin import _core
from palanquin.errors import ProblemError
from palanquin.problems import checks


@dataclass(frozen=True)
class LinkSettings:
    """A link between two planners.

    Attributes:
        delay: samples from sending to hearing, at least 1 (Assumption 2 has 1).
        loss: probability that a message is lost, 0 to 1; the newest one that was heard is kept.
        bias: added to the multipliers that a receiver agrees on, N/m (Fig. 23).
        bias_from: sample from which on it is added.
        seed: of the losses.
    """

    delay: int = 1
    loss: float = 0.0
    bias: float = 0.0
    bias_from: int = 0
    seed: int = 0

    def __post_init__(self) -> None:
        checks.positive("link.delay", self.delay)
        checks.finite("link.bias", self.bias)
        checks.non_negative("link.loss", self.loss)
        if self.loss > 1:
            raise ProblemError(f"link.loss is {self.loss}; a probability is at most 1")

    @property
    def core(self) -> _core.LinkSettings:
        """As the engine takes them."""
        return _core.LinkSettings(self.delay, self.loss, self.bias, self.bias_from, self.seed)
