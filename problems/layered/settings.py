"""Weights of the planners' cost, and what becomes of each of the holonomic rows (15)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from palanquin.errors import ProblemError
from palanquin.problems import checks

RowPolicy = Literal["hard", "off"] | float


@dataclass(frozen=True)
class LayeredSettings:
    """Settings that the three planners share (Kim et al., V-A.3).

    The defaults are what works (docs/layered.md); `PRINTED` has the paper's own values.

    Attributes:
        horizon: number N of intervals.
        dt: their length, s.
        position, velocity, rotation, angular_velocity: diagonals of Q, [3] each.
        terminal: P as a multiple of Q.
        force: R_u.
        multiplier: R_lambda.
        agreement: w of the agreement protocol (23).
        distance, rate, acceleration: the rows of (15): "hard", "off", or the weight of a quadratic
            penalty. The distance holds from knot 2 on and the rate from knot 1 on, the first that
            the inputs reach.
        slack: weight of a slack in the acceleration row that keeps the QP feasible; 0: none.
        friction: mu.
        normal: bounds of a standing foot's normal force, N.
        dual_terms: keep the neighbour's KKT multipliers in (23).
        exchanges: of the distributed planners, per sample.
    """

    horizon: int = 5
    dt: float = 0.005
    position: tuple[float, float, float] = (3e5, 3e7, 3e6)
    velocity: tuple[float, float, float] = (1e4, 1e4, 1e4)
    rotation: tuple[float, float, float] = (1e8, 1e8, 1e8)
    angular_velocity: tuple[float, float, float] = (5e3, 5e3, 5e3)
    terminal: float = 0.1
    force: float = 1e-2
    multiplier: float = 1e-2
    agreement: float = 1.0
    distance: RowPolicy = "off"
    rate: RowPolicy = "off"
    acceleration: RowPolicy = "hard"
    slack: float = 0.0
    friction: float = 0.6
    normal: tuple[float, float] = (0.0, 1e3)
    dual_terms: bool = True
    exchanges: int = 1

    def __post_init__(self) -> None:
        for name in ("position", "velocity", "rotation", "angular_velocity"):
            value = checks.array(f"settings.{name}", getattr(self, name), 3)
            if (value < 0).any():
                raise ProblemError(f"settings.{name} is {value.tolist()}; none may be negative")
        for name in ("dt", "force", "multiplier", "friction"):
            checks.positive(f"settings.{name}", getattr(self, name))
        for name in ("terminal", "agreement", "slack"):
            checks.non_negative(f"settings.{name}", getattr(self, name))
        for name in ("distance", "rate", "acceleration"):
            _check_policy(name, getattr(self, name))
        low, high = checks.array("settings.normal", self.normal, 2)
        if not 0 <= low < high:
            raise ProblemError(f"settings.normal is {self.normal}; 0 <= lowest < highest is needed")
        for name in ("horizon", "exchanges"):
            value = getattr(self, name)
            if not isinstance(value, int) or value < 1:
                raise ProblemError(
                    f"settings.{name} is {value!r}; an integer of at least 1 is needed"
                )

    @property
    def state_weight(self) -> np.ndarray:
        """Diagonals of Q at the knots 0..N-1 and of P at N, [N + 1, 12]."""
        diagonal = np.concatenate(
            [self.position, self.velocity, self.rotation, self.angular_velocity]
        )
        weight = np.tile(diagonal, (self.horizon + 1, 1))
        weight[-1] *= self.terminal
        return weight

    def row_flags(self) -> tuple[np.ndarray, np.ndarray]:
        """Whether a row of (15) is hard, and its penalty's weight, [N + 1, 3] each."""
        hard = np.zeros((self.horizon + 1, 3))
        penalty = np.zeros((self.horizon + 1, 3))
        for i, (policy, first) in enumerate(
            ((self.distance, 2), (self.rate, 1), (self.acceleration, 0))
        ):
            if policy == "hard":
                hard[first : self.horizon, i] = 1.0
            elif policy != "off":
                penalty[first : self.horizon, i] = float(policy)
        return hard, penalty


def _check_policy(name: str, policy: RowPolicy) -> None:
    if policy in ("hard", "off"):
        return
    if isinstance(policy, str):
        raise ProblemError(f"settings.{name} is {policy!r}; it must be hard, off or a weight")
    checks.non_negative(f"settings.{name}", policy)


WORKING = LayeredSettings()
PRINTED = replace(WORKING, multiplier=1e4, agreement=10.0, distance=1e10, rate=1e7)
VARIANTS = {"working": WORKING, "printed": PRINTED}
