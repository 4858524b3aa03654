"""What distributed planners tell each other, and the links that carry it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from palanquin.errors import ProblemError
from palanquin.problems import checks
from palanquin.problems.layered import rotations


@dataclass(frozen=True)
class Message:
    """A planner's optimal solution, as it sends it to its neighbours (Remark 5).

    Attributes:
        step: sample at which it was made.
        operating: R_op that xi is about, [3, 3].
        states: (r, v, xi, w), [N + 1, 12].
        inputs: forces [N, 4, 3].
        bars: multipliers [N, rows] by the bar's index.
        dual: multipliers beta of its dynamics, [N, 12].
        feet: where its feet stand, [4, 3].
        is_held: whether this is no plan but a state held for want of one.
    """

    step: int
    operating: np.ndarray
    states: np.ndarray
    inputs: np.ndarray
    bars: Mapping[int, np.ndarray]
    dual: np.ndarray
    feet: np.ndarray
    is_held: bool = False

    def aged_bar(self, bar: int, steps: int) -> np.ndarray:
        """The multipliers of a bar as seen `steps` samples later, [N, rows]."""
        values = self.bars[bar]
        return values[np.minimum(np.arange(len(values)) + steps, len(values) - 1)]

    def aged(self, steps: int) -> Message:
        """The same plan as seen `steps` samples later, xi about the rotation planned for then.

        States and multipliers are held at the end, forces are 0 beyond it.
        """
        if steps == 0:
            return self
        n = len(self.inputs)
        knots = np.minimum(np.arange(n + 1) + steps, n)
        intervals = np.arange(n) + steps
        held = np.minimum(intervals, n - 1)
        states = self.states[knots]
        operating = self.operating @ rotations.exp(states[0, 6:9])
        planned = self.operating @ rotations.exp(states[:, 6:9])
        states[:, 6:9] = rotations.log(operating.T @ planned)
        inputs = self.inputs[held]
        if not self.is_held:
            inputs = inputs * (intervals < n)[:, None, None]
        return Message(
            self.step, operating, states, inputs,
            {b: self.aged_bar(b, steps) for b in self.bars}, self.dual[held], self.feet,
            self.is_held,
        )  # fmt: skip


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


@dataclass
class Link:
    """One direction of a link: messages in, the newest that has arrived out."""

    settings: LinkSettings
    _sent: list[Message] = field(default_factory=list)
    _heard: Message | None = None

    def __post_init__(self) -> None:
        self._rng = np.random.default_rng(self.settings.seed)

    def send(self, message: Message) -> None:
        """Puts a message on its way, or loses it; the first, a greeting, always arrives."""
        is_first = self._heard is None and not self._sent
        if is_first or self._rng.random() >= self.settings.loss:
            self._sent.append(message)

    def receive(self, step: int) -> Message:
        """The newest message that has arrived by `step`, as seen now."""
        while self._sent and self._arrives(self._sent[0]) <= step:
            self._heard = self._sent.pop(0)
        assert self._heard is not None, "a link begins with a greeting"
        return self._heard.aged(step - self._heard.step)

    def bias(self, step: int) -> float:
        """What is added to the multipliers now."""
        return self.settings.bias if step >= self.settings.bias_from else 0.0

    def _arrives(self, message: Message) -> int:
        return message.step + (0 if message.is_held else self.settings.delay)
