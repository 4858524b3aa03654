"""Solving a case from its own data, from several starts where ditches leave a choice."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from palanquin.json_numbers import without_nan
from palanquin.plan import Ipopt, Plan, Sqp, Status
from palanquin.problems.clm.case import Case
from palanquin.problems.clm.case_problem import CaseProblem
from palanquin.problems.clm.layout import to_case_layout

Solver = Literal["rti", "sqp", "ipopt"]

# Most cases converge in less than 10 iterations; references out of a robot's reach on a steep ramp,
# where the curvature that Gauss-Newton leaves out matters, took up to 130.
_ITERATIONS = {"rti": 1, "sqp": 200}


@dataclass(frozen=True)
class CaseResult:
    """The best plan found for a case.

    Attributes:
        plan: the solver's outcome.
        solved: whether the solver reached what was asked of it: convergence, or for "rti" a plan
            that may be executed.
        starts: from how many starts it was the best.
        time_ms: of all starts together, without lowering.
        xs: states [N+1, 13 (R+1)] in the case's layout.
        us: inputs [N, 30 R] in the case's layout.
    """

    plan: Plan
    solved: bool
    starts: int
    time_ms: float
    xs: np.ndarray
    us: np.ndarray

    def to_json(self) -> dict[str, Any]:
        """The contents of the file that `palanquin solve` writes; null where there is no number."""
        plan = self.plan
        message = plan.message
        if self.starts > 1:
            message += f" (best of {self.starts} starts)"
        return without_nan(
            {
                "status": plan.status.name.lower(),
                "message": message,
                "cost": plan.cost,
                "tracking_cost": plan.tracking_cost,
                "penalty_cost": plan.penalty_cost,
                "equality_violation": plan.equality_violation,
                "inequality_violation": dict(plan.violation),
                "iterations": plan.iteration_count,
                "time_ms": self.time_ms,
                "X": self.xs.tolist(),
                "U": self.us.tolist(),
            }
        )


def solve_case(
    case: Case,
    solver: Solver = "sqp",
    qp: str | None = None,
    iterations: int | None = None,
    penalty: bool = False,
    max_starts: int = 16,
) -> CaseResult:
    """Solves a case with its own penalty, and returns the best local optimum found.

    Args:
        case: the problem instance.
        solver: "rti" (one SQP iteration unless told), "sqp" (to convergence) or "ipopt".
        qp: back end of the SQP's subproblem; the solver's default unless told.
        iterations: iteration limit; the method's own unless told.
        penalty: with "ipopt", penalties instead of hard inequalities; the SQP always has them.
        max_starts: how many foothold choices to try where reference footholds lie in ditches.

    Raises:
        ProblemError: an unknown option of the solver.
        LoweringError: the problem cannot be compiled.
    """
    converted = CaseProblem.of(case)
    lowered = converted.build().lower()
    params = lowered.parameters(case.N)
    converted.fill_parameters(params)
    measured = lowered.knot()
    converted.fill_measured(measured)

    options: dict[str, Any] = {}
    limit = iterations or _ITERATIONS.get(solver)
    if limit is not None:
        options["max_iterations"] = limit
    if solver == "ipopt":
        method: Sqp | Ipopt = Ipopt(lowered, horizon=case.N, penalize=penalty, **options)
    else:
        if qp is not None:
            options["qp"] = qp
        method = Sqp(lowered, horizon=case.N, **options)
    for family, policy in converted.policies().items():
        method.set_policy(family, policy)

    plans = []
    for feet in converted.starts(max_starts):
        guess = lowered.trajectory(case.N)
        converted.fill_guess(guess, feet)
        plans.append(method.solve(params, measured, guess))
    best = min(plans, key=lambda plan: _rank(plan, solver))
    xs, us = to_case_layout(best.trajectory, converted.team)
    return CaseResult(
        plan=best,
        solved=_is_solved(best, solver),
        starts=len(plans),
        time_ms=sum(plan.timings_ms["total"] for plan in plans),
        xs=xs,
        us=us,
    )


def _is_solved(plan: Plan, solver: Solver) -> bool:
    return plan.is_usable if solver == "rti" else plan.status == Status.CONVERGED


def _rank(plan: Plan, solver: Solver) -> tuple[bool, bool, float]:
    """Solved before usable before the rest, then by cost."""
    cost = plan.cost if math.isfinite(plan.cost) else math.inf
    return (not _is_solved(plan, solver), not plan.is_usable, cost)
