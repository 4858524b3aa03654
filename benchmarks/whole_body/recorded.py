"""QPs as the controllers of running robots meet them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palanquin import _sim
from palanquin.sim.runs.scenarios import loop_of
from palanquin.sim.scenarios.bar_team import BarTeam
from palanquin.sim.scenarios.bar_texts import parse_force, parse_ground
from palanquin.sim.scenarios.bars import BarScenario

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RecordedQp:
    """min 1/2 x'Hx + g'x s.t. E x = e, |x_i| <= limit_i for the first joints, C x >= c.

    Attributes:
        own: what our solver takes: each limit as two rows.
        H, g: [n, n] symmetric, [n].
        E, e: [p, n], [p], accelerations of limbs in contact.
        limit: [joints], N m.
        C, c: [m, n], [m], friction pyramids and bounds of normal forces.
    """

    own: _sim.DenseQp
    H: Array
    g: Array
    E: Array
    e: Array
    limit: Array
    C: Array
    c: Array

    @classmethod
    def of(cls, own: _sim.DenseQp, limit: Array) -> RecordedQp:
        """The parts of a QP that a robot with these torque limits has solved."""
        lower = np.tril(own.H)
        p, behind = own.equalities, own.equalities + 2 * len(limit)
        return cls(
            own, lower + np.tril(lower, -1).T, own.g,
            own.A[:p], own.b[:p], limit, own.A[behind:], own.b[behind:],
        )  # fmt: skip

    def cost(self, x: Array) -> float:
        """Objective at x."""
        return float(0.5 * x @ self.H @ x + self.g @ x)

    def violation(self, x: Array) -> float:
        """The largest of all rows', m/s^2, N m and N."""
        torques = np.abs(x[: len(self.limit)]) - self.limit
        rows = [np.abs(self.E @ x - self.e), torques, self.c - self.C @ x, np.zeros(1)]
        return float(max(row.max() for row in rows if row.size))


COURSES = {
    "flat": BarScenario(duration=3.0),
    "rough, 5 kg, 40 N": BarScenario(
        BarTeam(payload=5.0),
        parse_ground("rough:0.05", 1),
        forces=tuple(parse_force("sin:40", 2)),
        duration=3.0,
        seed=1,
    ),
}
"""Runs to record, by name."""


def record(scenario: BarScenario, count: int) -> list[RecordedQp]:
    """`count` QPs of all robots, evenly spread over the run from its first step on."""
    found = list(_walk(scenario))
    chosen = np.linspace(0, len(found) - 1, min(count, len(found))).astype(int)
    return [found[i] for i in chosen]


def _walk(scenario: BarScenario) -> Iterator[RecordedQp]:
    """The last QP of each planning period of each robot, once they trot."""
    loop = loop_of(scenario)
    plant: Any = loop.plant
    limits = {
        name: np.array([body.effort for body in robot.bodies() if np.any(body.axis)])
        for name, robot in plant.scene.descriptions.items()
    }
    for _ in islice(loop.ticks(), loop.most):
        if plant.time < 0.5:
            continue
        for robot, limit in enumerate(limits.values()):
            yield RecordedQp.of(plant.simulation.qp(robot), limit)
