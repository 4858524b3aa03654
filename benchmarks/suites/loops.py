"""Closed loops of problems of the collection: one SQP iteration a period against convergence.

The plant is the problem's own model, kicked every period; all controllers get the same kicks and
start from the same converged plan.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from palanquin.benchmarks.suites.stated_program import stage_cost
from palanquin.lowered import Lowered
from palanquin.named_array import NamedArray
from palanquin.plan import Plan, Sqp
from palanquin.policies import Hard, Penalty, Policy
from palanquin.problems.collection import COLLECTION, Start

DROPPED = 1e-9  # a plan whose first states are further from the measured ones did not take them

Rows = Literal["hard", "penalised"]
PERCENTILES = {"p50": 50, "p99": 99, "p99.9": 99.9, "max": 100}


@dataclass(frozen=True)
class Controller:
    """One way to answer a measurement.

    Attributes:
        name: in tables.
        iterations: of the SQP at most.
        two_phases: prepare on the predicted state, feedback on the measured one.
    """

    name: str
    iterations: int
    two_phases: bool = False


CONVERGED = Controller("converged", 100)
CONTROLLERS = (CONVERGED, Controller("one", 1), Controller("two phases", 1, two_phases=True))


@dataclass
class LoopResult:
    """What a loop went through.

    Attributes:
        cost: of the states measured and the inputs applied, penalties included.
        violation: the largest of a hard row along them.
        statuses: how often each was returned.
        dropped: periods whose plan does not start at the measured state.
        unusable: periods in which the last plan went on instead.
        solve_ms: the solver's own time, period by period.
    """

    cost: float = 0.0
    violation: float = 0.0
    statuses: Counter[str] = field(default_factory=Counter)
    dropped: int = 0
    unusable: int = 0
    solve_ms: list[float] = field(default_factory=list)

    def count(self, plan: Plan, is_dropped: bool) -> None:
        """Takes a plan's status down."""
        self.statuses[plan.status.name.lower()] += 1
        self.dropped += is_dropped
        self.unusable += not plan.is_usable
        self.solve_ms.append(plan.timings_ms["total"])

    def to_json(self) -> dict[str, Any]:
        """A row's columns."""
        return {
            "cost": self.cost if np.isfinite(self.cost) else None,
            "violation": self.violation if np.isfinite(self.violation) else None,
            "statuses": dict(self.statuses),
            "dropped": self.dropped,
            "unusable": self.unusable,
            "solve_ms": {
                name: float(np.percentile(self.solve_ms, rank))
                for name, rank in PERCENTILES.items()
            },
        }


@dataclass(frozen=True)
class Loop:
    """A problem of the collection in a closed loop.

    Attributes:
        problem: its name.
        steps: periods of the problem's dt.
        kicks: standard deviation of what is added to blocks every period.
        penalty: for rows that are hard in the other variant.
    """

    problem: str
    steps: int
    kicks: Mapping[str, float]
    penalty: Policy = field(default_factory=lambda: Penalty(stiffness=1e3, smoothing=1e-2))

    @property
    def name(self) -> str:
        """In tables."""
        return self.problem

    def run(self, rows: Rows, controllers: tuple[Controller, ...], seed: int) -> list[LoopResult]:
        """One result a controller."""
        problem = COLLECTION[self.problem].build()
        lowered = problem.lower()
        start = COLLECTION[self.problem].starts(lowered)["line"]
        policy = Hard() if rows == "hard" else self.penalty
        policies = dict.fromkeys(lowered.policies, policy)
        cost = stage_cost(problem, policies)

        def solver(iterations: int) -> Sqp:
            made = Sqp(lowered, qp=back_end(rows), max_iterations=iterations)
            for family, chosen in policies.items():
                made.set_policy(family, chosen)
            return made

        first = solver(300).solve(*start).trajectory
        results = []
        for controller in controllers:
            random = np.random.default_rng(seed)
            by = solver(controller.iterations)
            results.append(self._drive(by, controller, lowered, start, first, cost, random))
        return results

    def _drive(
        self,
        solver: Sqp,
        controller: Controller,
        lowered: Lowered,
        start: Start,
        guess: NamedArray,
        cost: Callable[..., Any],
        random: np.random.Generator,
    ) -> LoopResult:
        result = LoopResult()
        p = start.parameters
        predicted = measured = start.measured
        states = _state_columns(lowered, COLLECTION[self.problem].build().blocks)
        for _ in range(self.steps):
            plan = answered(solver, controller, p, predicted, measured, guess)
            off = np.abs(plan.xs[0, states] - measured.values[states]).max()
            result.count(plan, not off <= DROPPED)
            used = plan.trajectory if plan.is_usable else guess
            applied = used.values[0].copy()
            applied[states] = measured.values[states]
            spent, worst = cost(applied, p.values[0])
            result.cost += float(spent)
            result.violation = max(result.violation, float(worst))
            guess = lowered.shift(used, p, float(p["dt"][0]))
            predicted = lowered.wrap(lowered.step(applied, p.values[0]))
            if not np.isfinite(predicted.values).all():
                result.cost = np.inf
                return result
            measured = self._kicked(predicted, random)
        return result

    def _kicked(self, knot: NamedArray, random: np.random.Generator) -> NamedArray:
        kicked = knot.copy()
        for name, deviation in self.kicks.items():
            kicked[name] = knot[name] + deviation * random.standard_normal(knot[name].shape)
        return kicked


def answered(
    solver: Sqp,
    controller: Controller,
    parameters: NamedArray,
    predicted: NamedArray,
    measured: NamedArray,
    guess: NamedArray,
) -> Plan:
    """The controller's plan for the measured knot."""
    if controller.two_phases and solver.prepare(parameters, predicted, guess):
        return solver.feedback(measured)
    return solver.solve(parameters, measured, guess)


def back_end(rows: Rows) -> str:
    """The QP back end that takes the rows."""
    return "multipliers" if rows == "hard" else "structured"


def _state_columns(lowered: Lowered, blocks: list[Any]) -> np.ndarray:
    """Columns of a knot vector that hold states."""
    knot = lowered.wrap(np.arange(lowered.knot().values.size, dtype=float))
    return np.concatenate([knot[b.name].astype(int) for b in blocks if b.is_state])


COLLECTION_LOOPS = (
    Loop("pendulum", 100, {"rate": 0.05}),
    Loop("chain", 60, {"velocities": 0.02}),
    Loop("quadrotor", 80, {"velocity": 0.05, "spin": 0.05}),
    Loop("unicycle", 80, {"pose": 0.01}),
)
