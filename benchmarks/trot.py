"""The task of the benchmarks: a team that trots behind a velocity command on its nominal model."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from palanquin.benchmarks.variant import Task
from palanquin.problem import Problem
from palanquin.problems.clm.build import build_clm
from palanquin.problems.clm.planner import Planner
from palanquin.problems.clm.references import VELOCITY
from palanquin.problems.clm.team import Carrier, Payload, Team
from palanquin.problems.clm.team_plan import TeamPlan, TeamState
from palanquin.problems.planning import Velocity
from palanquin.sim.runs.nominal import follow

PERIOD = 1 / 30  # s between two plans, and between two knots
COMMAND = Velocity(0.4)
DISTURBANCE = 0.005  # standard deviation of what is added to measured velocities, m/s, rad/s

# Where the payload is held, m; a team takes the first of them, a single robot stands below it.
_ATTACH = ((0.0, 0.6, 0.0), (0.0, -0.6, 0.0), (1.4, 0.0, 0.0), (-1.4, 0.0, 0.0))
_COLUMN = 1.4  # between the pairs of robots that a larger team walks in, m
_DITCH_WIDTH, _DITCH_SPACING, _FIRST_DITCH = 0.05, 0.6, 0.5  # m


def build_team(robots: int) -> Team:
    """Laikagos that carry 8 kg each; two of them are the paper's team."""
    carriers = tuple(Carrier(f"robot{i + 1}", place) for i, place in enumerate(_places(robots)))
    return Team(Payload(mass=8.0 * robots), carriers)


def _places(robots: int) -> tuple[tuple[float, float, float], ...]:
    if robots == 1:
        return ((0.0, 0.0, 0.0),)
    if robots <= len(_ATTACH):
        return _ATTACH[:robots]
    columns = (robots + 1) // 2
    front = 0.5 * (columns - 1) * _COLUMN
    return tuple((front - _COLUMN * (i // 2), _ATTACH[i % 2][1], 0.0) for i in range(robots))


@lru_cache(maxsize=16)
def build_problem(task: Task) -> Problem:
    """The task's optimal control problem."""
    return build_clm(build_team(task.robots), task.horizon, PERIOD, ditches=task.ditches)


def make_planner(task: Task, **options: Any) -> Planner:
    """A planner for the task; options are fields of `SqpSettings`."""
    return Planner(build_problem(task), ditches=ditch_lines(task.ditches), **options)


def ditch_lines(count: int) -> np.ndarray:
    """Ditches along y, [count, 4] as (a, b, c, width): a x + b y + c = 0, m."""
    x = _FIRST_DITCH + _DITCH_SPACING * np.arange(count)
    ones, zeros = np.ones(count), np.zeros(count)
    return np.column_stack([ones, zeros, -x, _DITCH_WIDTH * ones])


def disturbed(state: TeamState, random: np.random.Generator) -> TeamState:
    """The state with a small random change of all velocities (m/s, rad/s).

    Without it a trot settles, the shifted plan is all but optimal, and iterative QP solvers stop
    after a step or two: no measured robot does them that favour.
    """
    bodies = state.bodies.copy()
    bodies[:, VELOCITY.start :] += DISTURBANCE * random.standard_normal((len(bodies), 6))
    return TeamState(bodies, state.feet)


@dataclass
class ClosedLoop:
    """A planner and the nominal model that it moves, one period a tick.

    Loops with equal seeds are disturbed equally, whatever plans for them.
    """

    planner: Planner
    random: np.random.Generator

    def __post_init__(self) -> None:
        self.state = self.planner.nominal_state()
        self.ticks = 0
        self.planner.settle(0.0, self.state, COMMAND)

    def tick(self) -> tuple[TeamPlan, float]:
        """Plans and moves on; returns the plan and the cost that this period has incurred."""
        planner, state = self.planner, disturbed(self.state, self.random)
        plan = planner.solve(self.ticks * PERIOD, state, COMMAND)
        self.ticks += 1
        now, self.state = follow(planner, plan, state, PERIOD)
        return plan, self._incurred_cost(plan, now, self.state.bodies)

    def _incurred_cost(self, plan: TeamPlan, now: TeamState, bodies: np.ndarray) -> float:
        """Of one period, penalties included.

        That is the running cost of the measured state and the inputs applied there, and the
        terminal cost of the state `bodies` that they lead to.
        """
        planner = self.planner
        knots = plan.plan.xs[:2].copy()
        knots[0, planner.columns.bodies], knots[1, planner.columns.bodies] = now.bodies, bodies
        knots[0, planner.columns.feet] = now.feet
        return planner.lowered.evaluate(knots, planner.params.values[:2], knots[0]).cost
