"""Ways to take one timed step of a variant."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from palanquin.benchmarks.replay import Replay
from palanquin.benchmarks.stage_qps import qp_flops
from palanquin.benchmarks.trot import COMMAND, PERIOD, ClosedLoop, disturbed, make_planner
from palanquin.benchmarks.variant import SOLVERS, Task, Variant
from palanquin.plan import Plan, Sqp
from palanquin.problems.clm.planner import Planner
from palanquin.problems.clm.team_plan import TeamPlan

# A cold solve ends when the QP predicts less than this relative decrease of the cost. Tighter than
# what is compared, looser than what OSQP's accuracy can certify.
COLD_TOLERANCE = 1e-6
_COLD_ITERATIONS = 50
_COLD_EQUALITY_TOLERANCE = 1e-4


@dataclass(frozen=True)
class Step:
    """One timed solve.

    Attributes:
        phases_ms: the solver's own time, per phase.
        call_ms: from measurement to plan: references, warm start and the solve.
        cost: warm, what the closed loop incurred in this period; cold, of the plan.
        iterations: SQP iterations.
        qps: QPs solved in them.
        failure: empty if the plan may be executed (cold: if it has converged), else why not.
        setup_ms: construction of the solver, where each step has a new one.
        feedback_ms: of the same step in two phases, what comes after the measurement; taken at
            some steps only.
        replay_ms: of steps up to this one, the solver's time when they are taken again back to
            back; at some steps only.
    """

    phases_ms: dict[str, float]
    call_ms: float
    cost: float
    iterations: int
    qps: int
    failure: str = ""
    setup_ms: float | None = None
    feedback_ms: float | None = None
    replay_ms: tuple[float, ...] = ()

    @property
    def solve_ms(self) -> float:
        """The solver's own time."""
        return sum(self.phases_ms.values())

    @staticmethod
    def of(plan: TeamPlan, cost: float, is_good: bool, setup_ms: float | None = None) -> Step:
        """What a plan says about its making."""
        solved = plan.plan
        return Step(
            phases_ms={k: v for k, v in solved.timings_ms.items() if k != "total"},
            call_ms=plan.solve_ms,
            cost=cost,
            iterations=solved.iteration_count,
            qps=sum(record.inner_iterations for record in solved.iterations),
            failure="" if is_good else f"{solved.status.name.lower()}: {solved.message}",
            setup_ms=setup_ms,
        )


class Run(Protocol):
    """A variant under measurement."""

    def step(self) -> Step:
        """Takes one timed step."""

    def flops(self) -> float | None:
        """Floating-point operations of the QP solved last, where they can be counted."""


class FeedbackProbe:
    """Takes steps of a closed loop once more in two phases, by a solver of its own.

    Not every step: it would drive the loop's solver out of the caches.
    """

    EVERY = 8

    def __init__(self, planner: Planner, options: dict[str, Any]) -> None:
        self._planner = planner
        self._sqp = Sqp(planner.lowered, **options)
        self._last: Plan | None = None
        self._steps = 0

    def measure(self, plan: Plan) -> float | None:
        """Milliseconds of the feedback phase of the step that led to `plan`, if it is its turn."""
        last, self._last = self._last, plan
        self._steps += 1
        if last is None or self._steps % self.EVERY:
            return None
        at = plan.evaluation.snapshot
        guess = self._planner.lowered.shift(last.trajectory, self._planner.params, PERIOD)
        engine = self._sqp._core
        if not engine.prepare(at.parameters, at.measured, guess.values):
            return None
        return float(engine.feedback_plan(at.measured).feedback_ms)


class WarmRun:
    """A closed loop with one SQP iteration a period, from the shifted plan."""

    def __init__(self, variant: Variant, seed: int, max_iterations: int = 1) -> None:
        options = {**variant.options(), "max_iterations": max_iterations}
        planner = make_planner(variant.task, **options)
        self._is_structured = variant.by.qp == "structured"
        self._replay = Replay(planner.lowered, options)
        self._loop = ClosedLoop(planner, np.random.default_rng(seed))
        self._probe = FeedbackProbe(planner, options) if self._is_structured else None

    def step(self) -> Step:
        """One period."""
        plan, cost = self._loop.tick()
        step = Step.of(plan, cost, plan.plan.is_usable)
        feedback_ms = None if self._probe is None else self._probe.measure(plan.plan)
        return replace(step, feedback_ms=feedback_ms, replay_ms=self._replay.measure(plan.plan))

    def flops(self) -> float | None:
        """Of the structured solver; the others' libraries count none."""
        return qp_flops(self._loop.planner.sqp) if self._is_structured else None


class ColdRun:
    """Solves from the references to convergence, each with a solver that has seen nothing yet.

    The instances run through the gait, a knot at a time, and stand with disturbed velocities.
    """

    def __init__(self, variant: Variant, seed: int) -> None:
        self._options = {
            **variant.options(),
            "max_iterations": _COLD_ITERATIONS,
            "cost_tolerance": COLD_TOLERANCE,
            "equality_tolerance": _COLD_EQUALITY_TOLERANCE,
        }
        self._planner = make_planner(variant.task, **self._options)
        self._random = np.random.default_rng(seed)
        self._time = 0.0

    def step(self) -> Step:
        """One instance, the next phase of the gait."""
        planner = self._planner
        planner.restart()
        start = time.perf_counter()
        planner.sqp = Sqp(planner.lowered, **self._options)
        setup_ms = 1e3 * (time.perf_counter() - start)
        state = disturbed(planner.nominal_state(), self._random)
        plan = planner.solve(self._time, state, COMMAND)
        self._time += PERIOD
        converged = plan.plan.status.name == "CONVERGED"
        return Step.of(plan, plan.plan.cost, converged, setup_ms)

    def flops(self) -> float | None:
        """Counted for warm steps only."""
        return None


def start_run(variant: Variant, seed: int) -> Run:
    """The run that the variant asks for."""
    return WarmRun(variant, seed) if variant.start == "warm" else ColdRun(variant, seed)


def converged_cost(task: Task, steps: int, skip: int, seed: int) -> float:
    """Mean cost a period of a loop that solves every one to the end; the first `skip` left out."""
    run = WarmRun(Variant(task, SOLVERS[0]), seed, max_iterations=50)
    costs = [run.step().cost for _ in range(skip + steps)]
    return float(np.mean(costs[skip:]))
