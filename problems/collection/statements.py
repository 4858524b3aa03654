"""Phrases that several problems of the collection share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca

from palanquin.policies import Hard
from palanquin.problem import Problem, Role


def rk4(rate: Callable[[ca.SX], ca.SX], x: ca.SX, h: ca.SX | float) -> ca.SX:
    """X after h seconds of x' = rate(x), one step of the classical Runge-Kutta method."""
    k1 = rate(x)
    k2 = rate(x + h / 2 * k1)
    k3 = rate(x + h / 2 * k2)
    k4 = rate(x + h * k3)
    return x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def bounds(
    problem: Problem, name: str, value: ca.SX, lower: Any, upper: Any, **options: Any
) -> None:
    """Hard rows lower <= value <= upper; each side a number, numbers or an expression."""
    rows = ca.vertcat(value - ca.SX(upper), ca.SX(lower) - value)
    problem.inequality(name, rows, Hard(), **options)


def free_constant(problem: Problem, name: str, lower: float, upper: float) -> ca.SX:
    """A scalar in [lower, upper] that is decided with the trajectory: free at the first knot,
    carried from there. It does not exist at the terminal knot.
    """
    first = first_knot(problem)
    value = problem.variable(name, 1, role=ca.if_else(first, Role.INPUT, Role.CARRIED))
    bounds(problem, name, value, lower, upper, active=first)
    return value


def at_first_knot(problem: Problem, name: str, size: int) -> ca.SX:
    """An input that exists at the first knot alone, for an initial state that is free."""
    first = first_knot(problem)
    return problem.variable(name, size, role=ca.if_else(first, Role.INPUT, Role.ABSENT))


def free_duration(problem: Problem, lower: float, upper: float) -> ca.SX:
    """The length h (s) of every interval when the duration N h is free and is the cost."""
    duration = free_constant(problem, "duration", lower, upper)
    problem.cost("duration", duration / problem.horizon)
    return duration / problem.horizon


def first_knot(problem: Problem) -> ca.SX:
    """A parameter that is 1 at knot 0 and 0 elsewhere; the starts set it."""
    known = {parameter.name: parameter for parameter in problem.parameters}
    return known["first"].symbol if "first" in known else problem.parameter("first")
