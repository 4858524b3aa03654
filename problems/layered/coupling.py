"""A bar in a problem: its multipliers as inputs, its forces, and its rows (14), (15)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from palanquin.problem import Expression, Problem, Role
from palanquin.problems.layered.bar import Bar
from palanquin.problems.layered.holonomic import Holonomic
from palanquin.problems.layered.robot import Robot

# The rows of (14), in the order of the parameters `<bar>.hard` and `<bar>.penalty`.
LEVELS = ("distance", "rate", "acceleration")


@dataclass(eq=False)
class Coupling:
    """Handle of a bar at one knot.

    Attributes:
        name: prefix of its block and parameters.
        holonomic: its rows, over its two robots.
        multiplier: lambda [rows]; for the distance row N/m, for an angle N m.
    """

    name: str
    holonomic: Holonomic
    multiplier: Expression

    def connect(self, ends: Sequence[Robot], multiplier: Expression | None = None) -> None:
        """Applies the forces (p_i - p_j) lambda, (3), and a restricted joint's torques, with
        `multiplier` in place of its own if given.
        """
        multiplier = self.multiplier if multiplier is None else multiplier
        jacobians = self.holonomic.jacobians([e.motion for e in ends])
        for end, (linear, angular) in zip(ends, jacobians, strict=True):
            end.force += linear.T @ multiplier
            end.torque += angular.T @ multiplier

    def rows(self, ends: Sequence[Robot]) -> list[Expression]:
        """Psi - psi_0, its rate and its acceleration, (14), when all forces are applied."""
        motions = [e.motion for e in ends]
        linear = [e.acceleration() for e in ends]
        angular = [e.angular_acceleration() for e in ends]
        h = self.holonomic
        return [h.value(motions), h.rate(motions), h.acceleration(motions, linear, angular)]


@dataclass(frozen=True)
class CouplingModule:
    """Adds a bar's multipliers to a problem; `state_rows` adds its rows once all forces are known.

    Parameters added: `<bar>.geometry` [7] (d_1, d_2, psi_0), `<bar>.weight` (R_lambda),
    `<bar>.agreement` (w) with `<bar>.agreed` [rows], the value to agree on; `<bar>.hard` [3] flags
    and `<bar>.penalty` [3] weights of distance, rate and acceleration; `<bar>.slack`, weight of the
    acceleration row's slack (0: none).
    """

    name: str
    bar: Bar

    def add_to(self, problem: Problem) -> Coupling:
        """Adds block, parameters and the multipliers' cost; returns the handle."""
        name, rows = self.name, self.bar.rows
        constants = problem.parameter(f"{name}.geometry", 7, default=self.bar.constants())
        multiplier = problem.input(f"{name}.lambda", rows)
        weight = problem.parameter(f"{name}.weight", default=1e-2)
        problem.residual(f"{name}.lambda", multiplier, weight=weight)
        agreement = problem.parameter(f"{name}.agreement", default=0.0)
        agreed = problem.parameter(f"{name}.agreed", rows)
        problem.residual(f"{name}.agreement", multiplier - agreed, weight=agreement)
        return Coupling(name, Holonomic(self.bar.value, 2, constants), multiplier)

    def state_rows(self, problem: Problem, rows: Sequence[Expression], robot: str = "") -> None:
        """Adds the rows (15), each hard, penalised or left out as the parameters say."""
        name = self.name
        hard = problem.parameter(f"{name}.hard", 3, default=(0.0, 0.0, 1.0))
        penalty = problem.parameter(f"{name}.penalty", 3)
        slack_weight = problem.parameter(f"{name}.slack")
        role = ca.if_else(slack_weight > 0, Role.INPUT, Role.ABSENT)
        slack = problem.variable(f"{name}.slack", self.bar.rows, role)
        problem.residual(f"{name}.slack", slack, weight=slack_weight)
        for i, (level, row) in enumerate(zip(LEVELS, rows, strict=True)):
            relaxed = row + slack if level == "acceleration" else row
            problem.equality(f"bar.{level}", relaxed, robot=robot, limb=name, active=hard[i])
            problem.residual(f"{name}.{level}", row, weight=penalty[i])
