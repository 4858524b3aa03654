"""A single rigid body, moved by the wrenches that other modules apply to it.

Equations (2), (3) and (4) of De Vincenti and Coros.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import casadi as ca

from palanquin import quaternion
from palanquin.problem import Expression, Problem
from palanquin.problems import checks

GRAVITY = (0.0, 0.0, -9.81)  # m/s^2, world axes


@dataclass(eq=False)
class Body:
    """Handle of a rigid body: its symbols at one knot and the wrench collected so far.

    Attributes:
        name: prefix of its blocks and parameters.
        dt: length of the interval, s.
        position: centre of mass in the world, m, [3].
        orientation: unit quaternion, body to world, [4].
        velocity: of the centre of mass, world axes, m/s, [3].
        angular_velocity: body axes, rad/s, [3].
        mass: kg.
        inertia: principal moments about the body axes, kg m^2, [3].
        force: sum of applied forces, world axes, N, [3].
        torque: sum of applied moments about the centre of mass, world axes, N m, [3].
    """

    name: str
    dt: Expression
    position: Expression
    orientation: Expression
    velocity: Expression
    angular_velocity: Expression
    mass: Expression
    inertia: Expression
    force: Expression = field(default_factory=lambda: ca.SX.zeros(3))
    torque: Expression = field(default_factory=lambda: ca.SX.zeros(3))

    def offset(self, point: Expression) -> Expression:
        """Body-fixed `point` [3] as a vector from the centre of mass, in world axes."""
        return quaternion.rotate(self.orientation, point)

    def apply(self, force: Expression, arm: Expression, torque: Expression | None = None) -> None:
        """Applies `force` [3] at `arm` [3] from the centre of mass, and a `torque` [3] (world)."""
        self.force = self.force + force
        self.torque = self.torque + ca.cross(arm, force)
        if torque is not None:
            self.torque = self.torque + torque

    def acceleration(self) -> Expression:
        """Acceleration of the centre of mass (2a), (3a), world axes, m/s^2, [3]."""
        return self.force / self.mass + ca.SX(GRAVITY)

    def angular_acceleration(self) -> Expression:
        """Angular acceleration (2b), (3b), body axes, rad/s^2, [3]."""
        gyroscopic = ca.cross(self.angular_velocity, self.inertia * self.angular_velocity)
        torque = quaternion.rotate_inverse(self.orientation, self.torque)
        return (torque - gyroscopic) / self.inertia


class RigidBody:
    """A body that moves freely under gravity and applied wrenches.

    Its next velocity follows from the wrench at this knot, its next pose from the next velocity:
    the semi-implicit Euler scheme (4) on R^3 x S^3.

    Parameters added: `<name>.mass`, `<name>.inertia` [3], and `<name>.external_force` and
    `<name>.external_torque` [3], a known disturbance in world axes (zero by default).

    Args:
        name: prefix of the body's blocks `<name>.position`, `.orientation`, `.velocity` and
            `.angular_velocity`.
        mass: kg, positive.
        inertia: principal moments about the body axes, kg m^2, [3], positive. They need not fulfil
            the triangle inequality, since the paper's payload does not.
    """

    def __init__(self, name: str, mass: float, inertia: Sequence[float]) -> None:
        self.name = name
        self.mass = checks.positive(f"{name}.mass", mass)
        self.inertia = checks.positive_array(f"{name}.inertia", inertia, 3)

    def add_to(self, problem: Problem) -> Body:
        """Adds states and dynamics; returns the handle to which wrenches are applied."""
        name = self.name
        body = Body(
            name=name,
            dt=problem.dt,
            position=problem.state(f"{name}.position", 3),
            orientation=problem.quaternion_state(f"{name}.orientation"),
            velocity=problem.state(f"{name}.velocity", 3),
            angular_velocity=problem.state(f"{name}.angular_velocity", 3),
            mass=problem.parameter(f"{name}.mass", default=self.mass),
            inertia=problem.parameter(f"{name}.inertia", 3, default=self.inertia),
        )
        body.force = problem.parameter(f"{name}.external_force", 3)
        body.torque = problem.parameter(f"{name}.external_torque", 3)
        dt, position, orientation = problem.dt, body.position, body.orientation
        velocity, angular_velocity = body.velocity, body.angular_velocity
        problem.dynamics(position, increment=dt * problem.next(velocity))  # (4a)
        problem.dynamics(orientation, increment=dt * problem.next(angular_velocity))  # (4b)
        # (4c), (4d): deferred, since modules that are added later apply their wrenches.
        problem.dynamics(velocity, increment=lambda: dt * body.acceleration())
        problem.dynamics(angular_velocity, increment=lambda: dt * body.angular_acceleration())
        return body
