"""Phrases that several problems of the collection share."""

from __future__ import annotations

import casadi as ca

from palanquin.problem import Problem


def free_duration(problem: Problem, lower: float, upper: float) -> ca.SX:
    """The length h (s) of every interval when the duration N h is free and is the cost."""
    duration = problem.constant("duration", lower=lower, upper=upper)
    problem.cost("duration", duration / problem.horizon)
    return duration / problem.horizon
