"""Ditches that no foot may step into: equations (11), (18) of De Vincenti and Coros."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import casadi as ca
import numpy as np

from palanquin.errors import ProblemError
from palanquin.policies import Penalty
from palanquin.problem import Expression, Problem
from palanquin.problems import checks
from palanquin.problems.modules.families import Family, register
from palanquin.problems.modules.leg import Foot
from palanquin.problems.modules.limits import REACH_POLICY

DITCH = register(Family("ditch", REACH_POLICY))

Formulation = Literal["distance", "squared"]


@dataclass(frozen=True)
class DitchField:
    """Handle of the ditches: how many there may be, and their default lines [at_most, 4]."""

    at_most: int
    lines: np.ndarray


class Ditches:
    """Keeps every foot that the problem has so far out of strips of the ground, at all knots.

    A ditch runs along a x + b y + c = 0 and is d wide. The parameter `ditches` [at_most, 4] holds
    (a, b, c, d) of each, m; a width of 0 means that there is none, and its rows are inactive.

    Args:
        at_most: number of ditches that one problem can hold, at least 1.
        lines: default ditches [n, 4], n <= at_most.
        formulation: "distance" has rows in m (11), "squared" in m^2 (18). Appendix A says why the
            first is better: the slope of the second vanishes towards the middle of a ditch.
        policy: how the rows enter.
    """

    def __init__(
        self,
        at_most: int = 12,
        lines: Sequence[Sequence[float]] = (),
        formulation: Formulation = "distance",
        policy: Penalty = DITCH.policy,
    ) -> None:
        if not isinstance(at_most, int) or at_most < 1:
            raise ProblemError(f"ditches.at_most is {at_most!r}; it must be an integer >= 1")
        if formulation not in get_args(Formulation):
            known = ", ".join(get_args(Formulation))
            raise ProblemError(f"ditches.formulation is {formulation!r}; it must be one of {known}")
        self.at_most = at_most
        self.lines = padded_lines(lines, at_most)
        self.formulation = formulation
        self.policy = policy

    def add_to(self, problem: Problem) -> DitchField:
        """Adds one row per ditch and foot."""
        lines = problem.parameter("ditches", (self.at_most, 4), self.lines)
        row = intrusion if self.formulation == "distance" else squared_intrusion
        for foot in problem.handles(Foot):
            for j in range(self.at_most):
                problem.inequality(
                    "ditch",
                    row(lines[j, :], foot.position),
                    policy=self.policy,
                    active=lines[j, 3] > 0,
                    robot=foot.robot,
                    limb=foot.limb,
                )
        return DitchField(self.at_most, self.lines)


def intrusion(line: Expression, position: Expression) -> Expression:
    """Depth of a foot in a ditch, d/2 - |a x + b y + c| / sqrt(a^2 + b^2), m (11)."""
    offset, width = _offset_and_width(line, position)
    # CasADi's fabs has slope 0 at 0, which would leave a foot in the middle of a ditch.
    return width / 2 - ca.if_else(offset < 0, -offset, offset)


def squared_intrusion(line: Expression, position: Expression) -> Expression:
    """The squared form d^2/4 - (a x + b y + c)^2 / (a^2 + b^2), m^2 (18), for any direction."""
    offset, width = _offset_and_width(line, position)
    return width**2 / 4 - offset**2


def _offset_and_width(line: Expression, position: Expression) -> tuple[Expression, Expression]:
    """Signed distance of a foot from a ditch's centre line and the ditch's width, m."""
    a, b, c, width = ca.vertsplit(line.T)
    return (a * position[0] + b * position[1] + c) / ca.sqrt(a**2 + b**2), width


def padded_lines(lines: Sequence[Sequence[float]] | np.ndarray, at_most: int) -> np.ndarray:
    """Ditches as a parameter [at_most, 4]; the missing ones get width 0.

    Raises ProblemError when there are too many, a direction (a, b) is zero or a width negative.
    """
    given = np.asarray(lines, dtype=float).reshape(-1, 4) if len(lines) else np.empty((0, 4))
    if len(given) > at_most:
        raise ProblemError(f"ditches: {len(given)} are given; at most {at_most} are possible")
    for j, line in enumerate(checks.array("ditches", given, len(given), 4)):
        if np.hypot(line[0], line[1]) == 0:
            raise ProblemError(f"ditches[{j}]: a and b are both 0; a line needs a direction")
        checks.non_negative(f"ditches[{j}].d", line[3])
    missing = np.tile([1.0, 0.0, 0.0, 0.0], (at_most - len(given), 1))
    return np.vstack([given, missing])
