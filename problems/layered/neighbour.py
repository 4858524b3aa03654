"""A robot that a local planner does not plan for, but hears from (18)-(21)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from palanquin.problem import Expression, Problem
from palanquin.problems.layered.robot import INPUT, STATE, Robot


def add_neighbour(problem: Problem, name: str) -> Robot:
    """A robot whose parameters `<name>.rotation`, `.mass`, `.inertia`, `.feet` and `.contact` are
    added; `placed` puts it somewhere.
    """
    nowhere = ca.SX.zeros(3)
    return Robot(
        name=name,
        position=nowhere,
        velocity=nowhere,
        xi=nowhere,
        angular_velocity=nowhere,
        operating_rotation=problem.parameter(f"{name}.rotation", (3, 3), default=np.eye(3)),
        mass=problem.parameter(f"{name}.mass", default=1.0),
        inertia=problem.parameter(f"{name}.inertia", 3, default=1.0),
        feet=problem.parameter(f"{name}.feet", (4, 3)),
        contact=problem.parameter(f"{name}.contact", 4, default=1.0),
    )


def placed(robot: Robot, x: Expression, u: Expression) -> Robot:
    """The same robot in state `x` [12], pushed by the forces `u` [12] of its stance legs alone."""
    r, v, xi, w = ca.vertsplit(x, 3)
    copy = replace(
        robot,
        position=r,
        velocity=v,
        xi=xi,
        angular_velocity=w,
        forces=ca.vertsplit(u, 3),
        force=ca.SX.zeros(3),
        torque=ca.SX.zeros(3),
        influence=ca.SX.zeros(STATE),
    )
    assert robot.feet is not None
    assert robot.contact is not None
    for i, force in enumerate(copy.forces):
        copy.push(robot.contact[i] * force, robot.feet[i, :].T)
    return copy


@dataclass(frozen=True)
class OperatingPoint:
    """Parameters `<name>.op` [12] and `<name>.op_input` [12]: where a robot is linearised."""

    state: Expression
    input: Expression

    @classmethod
    def of(cls, problem: Problem, name: str) -> OperatingPoint:
        """Adds the parameters."""
        return cls(
            problem.parameter(f"{name}.op", STATE), problem.parameter(f"{name}.op_input", INPUT)
        )


@dataclass(frozen=True)
class Heard:
    """Parameters of what a neighbour sent: `<name>.plan` [12] and `<name>.plan_input` [12], its
    state and input at this knot, and `<name>.dual` [12], the multipliers beta of its dynamics.
    """

    state: Expression
    input: Expression
    dual: Expression

    @classmethod
    def of(cls, problem: Problem, name: str) -> Heard:
        """Adds the parameters."""
        return cls(
            problem.parameter(f"{name}.plan", STATE),
            problem.parameter(f"{name}.plan_input", INPUT),
            problem.parameter(f"{name}.dual", STATE),
        )
