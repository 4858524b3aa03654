"""Disturbances in scenarios: pushes on any body at any time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from palanquin.schema import NonNegative, Positive, Strict
from palanquin.sim.scenarios.vectors import Name, Vector


class Push(Strict):
    """A constant wrench at a body's centre of mass for some time."""

    body: Name = Field(description="a robot's name, or payload")
    force: Vector = Field((0.0, 0.0, 0.0), description="world axes, N")
    torque: Vector = Field((0.0, 0.0, 0.0), description="world axes, N m")
    start: NonNegative = Field(description="s")
    duration: Positive = Field(description="s")
    known: bool = Field(False, description="whether the planner knows of it beforehand")

    @model_validator(mode="after")
    def _require_wrench(self) -> Self:
        if not any(self.force + self.torque):
            raise ValueError("force and torque are both 0; one of them must push")
        return self


def mean_wrenches(
    pushes: Sequence[Push], bodies: Sequence[str], times: NDArray[np.float64], length: float
) -> NDArray[np.float64]:
    """Mean force and torque of `pushes` during the intervals of `length` (s) from `times` [n] on,
    per body, [n, len(bodies), 6]: the impulse is right whatever part of an interval a push covers.
    """
    wrenches = np.zeros((len(times), len(bodies), 6))
    for push in pushes:
        end = push.start + push.duration
        overlap = np.minimum(times + length, end) - np.maximum(times, push.start)
        share = np.clip(overlap / length, 0.0, 1.0)
        wrenches[:, bodies.index(push.body)] += share[:, None] * np.array(push.force + push.torque)
    return wrenches
