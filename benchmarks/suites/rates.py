"""What limits and prices of rates add to a step: the same problem without and with them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from palanquin.plan import Sqp
from palanquin.policies import Hard, Penalty
from palanquin.problem import Problem, Role

Row = dict[str, Any]
SIZES = ((12, 3), (36, 24))
"""States and inputs."""
LIMIT = 2.0  # of a change from knot to knot, which no plan here meets
_BOX = 5.0  # of an input, likewise
_HORIZON, _DT = 20, 0.1


@dataclass(frozen=True)
class Variant:
    """How rates enter.

    Attributes:
        name: in tables.
        stated: "rate" by the word `Problem.rate`, "link" as rows over two knots, "" not at all.
        enters: "cost", "penalised" or "hard" limits.
        has_box: whether inputs have hard bounds besides.
    """

    name: str
    stated: str = ""
    enters: str = ""
    has_box: bool = False


VARIANTS = (
    Variant("no rates"),
    Variant("rate, cost", "rate", "cost"),
    Variant("rate, penalised", "rate", "penalised"),
    Variant("rate, hard", "rate", "hard"),
    Variant("link, cost", "link", "cost"),
    Variant("link, penalised", "link", "penalised"),
    Variant("link, hard", "link", "hard"),
    Variant("no rates, hard inputs", has_box=True),
    Variant("rate, hard, hard inputs", "rate", "hard", has_box=True),
)


def build(states: int, inputs: int, variant: Variant) -> Problem:
    """Unit masses in a row of unit springs, pushed by forces between neighbours."""
    problem = Problem(horizon=_HORIZON, dt=_DT, name=f"rates_{states}")
    masses = states // 2
    p, v, u = problem.state("p", masses), problem.state("v", masses), problem.input("u", inputs)
    pushes = np.zeros((masses, inputs))
    for j in range(inputs):
        pushes[j % masses, j], pushes[(j + 1) % masses, j] = 1.0, -1.0 + 0.1 * j
    springs = 2 * np.eye(masses) - np.eye(masses, k=1) - np.eye(masses, k=-1)
    problem.dynamics(v, increment=_DT * (ca.DM(pushes) @ u - ca.DM(springs) @ p))
    problem.dynamics(p, increment=_DT * problem.next(v))
    problem.residual("p", p - 0.1, at="all")
    problem.residual("v", v, weight=0.1, at="all")
    problem.residual("u", u, weight=0.1)
    if variant.has_box:
        problem.bound("box", u, -_BOX, _BOX)
    if variant.stated:
        _state_rates(problem, u, variant)
    return problem


def _state_rates(problem: Problem, u: ca.SX, variant: Variant) -> None:
    if variant.stated == "rate":
        change = _DT * problem.rate(u)
    else:
        change = problem.variable("change", u.shape[0], role=Role.LOCAL)
        problem.link("change", change - (u - problem.previous(u)))
    if variant.enters == "cost":
        problem.residual("smooth", change, weight=0.1)
    else:
        policy = Hard() if variant.enters == "hard" else Penalty(stiffness=1e3, smoothing=1e-2)
        problem.bound("slew", change, -LIMIT, LIMIT, policy=policy)


class _Steps:
    """One SQP iteration from the converged plan, again and again, with the masses kicked."""

    def __init__(self, states: int, inputs: int, variant: Variant) -> None:
        self.lowered = build(states, inputs, variant).lower()
        self._parameters = self.lowered.parameters()
        rest = self.lowered.knot(), self.lowered.trajectory()
        plan = Sqp(self.lowered, max_iterations=50).solve(self._parameters, *rest)
        self._guess, self._sqp = plan.trajectory, Sqp(self.lowered, max_iterations=1)
        self.ms: list[float] = []

    def step(self, kick: np.ndarray) -> None:
        """Takes the solver's own time down."""
        measured = self.lowered.knot()
        measured["v"] = kick
        plan = self._sqp.solve(self._parameters, measured, self._guess)
        self.ms.append(plan.timings_ms["total"])


def run_rates(repetitions: int, seed: int, announce: Callable[[str], None]) -> list[Row]:
    """A row for each size and variant; all take turns, forwards and backwards.

    `ratio` is to "no rates" of the same size and bounds on inputs, medians over medians.
    """
    rows: list[Row] = []
    for states, inputs in SIZES:
        announce(f"{states} states, {inputs} inputs")
        runs = {variant: _Steps(states, inputs, variant) for variant in VARIANTS}
        random = np.random.default_rng(seed)
        for repetition in range(repetitions):
            kick = 0.01 * random.standard_normal(states // 2)
            order = VARIANTS if repetition % 2 else VARIANTS[::-1]
            for variant in order:
                runs[variant].step(kick)
        medians = {variant: float(np.median(run.ms)) for variant, run in runs.items()}
        for variant in VARIANTS:
            plain = next(v for v in VARIANTS if not v.stated and v.has_box == variant.has_box)
            rows.append({
                "states": states, "inputs": inputs, "variant": variant.name,
                "median_ms": medians[variant], "ratio": medians[variant] / medians[plain],
            })  # fmt: skip
    return rows
