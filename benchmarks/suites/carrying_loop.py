"""The closed loop of a team that carries a beam and whose payload is pushed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from palanquin.benchmarks.suites.loops import DROPPED, Controller, LoopResult, Rows, back_end
from palanquin.benchmarks.suites.stated_program import stage_cost
from palanquin.policies import Hard
from palanquin.problem import Problem
from palanquin.problems import gaits
from palanquin.problems.clm.build import build_clm
from palanquin.problems.clm.planner import Planner
from palanquin.problems.clm.references import VELOCITY
from palanquin.problems.clm.team_plan import TeamPlan, TeamState
from palanquin.problems.collection.contacts import Carrying
from palanquin.problems.planning import Velocity
from palanquin.sim.runs.nominal import follow

PERIOD = 1 / 30


@dataclass(frozen=True)
class CarryingLoop:
    """Two robots carry a beam; now and then the payload's velocity jumps.

    Attributes:
        gait: "trot" walks at 0.4 m/s, "stand" stays.
        push: the largest jump in x and in y, m/s.
        every: how many periods of 1/30 s are between two pushes.
        steps: periods.
    """

    problem: ClassVar[str] = "carrying"
    gait: str = "trot"
    push: float = 0.5
    every: int = 3
    steps: int = 90

    @property
    def name(self) -> str:
        """In tables."""
        return f"carrying, {self.gait}, {self.push} m/s"

    def run(self, rows: Rows, controllers: tuple[Controller, ...], seed: int) -> list[LoopResult]:
        """One result a controller."""
        gait = gaits.by_name(self.gait)
        carriers = tuple(replace(c, gait=gait) for c in Carrying.team.carriers)
        problem = build_clm(replace(Carrying.team, carriers=carriers), 15, PERIOD)
        return [self._drive(problem, rows, c, np.random.default_rng(seed)) for c in controllers]

    def _drive(
        self, problem: Problem, rows: Rows, controller: Controller, random: np.random.Generator
    ) -> LoopResult:
        planner = Planner(problem, qp=back_end(rows), max_iterations=controller.iterations)
        policies = dict(planner.lowered.policies)
        if rows == "hard":
            policies = dict.fromkeys(policies, Hard())
        for family, policy in policies.items():
            planner.set_policy(family, policy)
        cost = stage_cost(problem, policies)
        command, result = Velocity(0.4 if self.gait == "trot" else 0.0), LoopResult()
        predicted = state = planner.nominal_state()
        planner.settle(0.0, state, command)
        for tick in range(self.steps):
            time = tick * PERIOD
            plan = self._answer(planner, controller, time, predicted, state, command)
            columns, knot = planner.columns, plan.plan.xs[0].copy()
            off = np.abs(knot[columns.bodies] - state.bodies).max()
            result.count(plan.plan, not off <= DROPPED)
            knot[columns.bodies] = state.bodies
            spent, worst = cost(knot, planner.params.values[0])
            result.cost += float(spent)
            result.violation = max(result.violation, float(worst))
            _, predicted = follow(planner, plan, state, PERIOD)
            if not np.isfinite(predicted.bodies).all():
                result.cost = np.inf
                break
            state = (
                self._pushed(predicted, random)
                if tick % self.every == self.every - 1
                else predicted
            )
        return result

    def _answer(
        self,
        planner: Planner,
        controller: Controller,
        time: float,
        predicted: TeamState,
        state: TeamState,
        command: Velocity,
    ) -> TeamPlan:
        if controller.two_phases:
            planner.prepare(time, predicted, command)
            return planner.feedback(state)
        return planner.solve(time, state, command)

    def _pushed(self, state: TeamState, random: np.random.Generator) -> TeamState:
        bodies = state.bodies.copy()
        bodies[0, VELOCITY.start : VELOCITY.start + 2] += self.push * random.uniform(-1, 1, 2)
        return TeamState(bodies, state.feet)


CARRYING_LOOPS = (CarryingLoop(), CarryingLoop("stand"), CarryingLoop("stand", push=0.05))
