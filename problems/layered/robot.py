"""One robot of the interconnected model: a single rigid body in variational coordinates.

Kim et al., eqs. (3), (8), (11), (12). The state of robot i is (r, v, xi, w): position and velocity
of the centre of mass in the world, rotation R = R_op exp(hat(xi)) ~ R_op (I + hat(xi)) about the
operating point, and angular velocity in body axes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from palanquin.problem import Expression, Problem
from palanquin.problems import checks
from palanquin.problems.layered.holonomic import Motion, hat
from palanquin.problems.modules.rigid_body import GRAVITY

LIMBS = ("LF", "RF", "LH", "RH")
STATE = 12  # size of (r, v, xi, w)
INPUT = 12  # size of the ground reaction forces


@dataclass(eq=False)
class Robot:
    """Handle of a robot at one knot: its symbols and the wrench collected so far.

    Attributes:
        name: prefix of its blocks and parameters.
        position, velocity: world axes, m and m/s, [3].
        xi: rotation vector about the operating point, body axes, rad, [3].
        angular_velocity: body axes, rad/s, [3].
        operating_rotation: R_op, body to world, [3, 3].
        mass: kg.
        inertia: principal moments about the body axes, kg m^2, [3].
        feet: where the feet stand in the world, m, [4, 3]; set with the forces.
        contact: flags of the feet that stand, [4].
        forces: ground reaction forces of the four feet, world axes, N, [3] each.
        force: sum of applied forces, world axes, N, [3].
        torque: sum of applied moments about the centre of mass, body axes, N m, [3].
        influence: what others' deviations from their operating points add to the derivative of the
            state, (19), [12].
    """

    name: str
    position: Expression
    velocity: Expression
    xi: Expression
    angular_velocity: Expression
    operating_rotation: Expression
    mass: Expression
    inertia: Expression
    feet: Expression | None = None
    contact: Expression | None = None
    forces: list[Expression] = field(default_factory=list)
    force: Expression = field(default_factory=lambda: ca.SX.zeros(3))
    torque: Expression = field(default_factory=lambda: ca.SX.zeros(3))
    influence: Expression = field(default_factory=lambda: ca.SX.zeros(STATE))

    @property
    def rotation(self) -> Expression:
        """R ~ R_op (I + hat(xi)), (12)."""
        return self.operating_rotation @ (ca.SX.eye(3) + hat(self.xi))

    @property
    def state(self) -> Expression:
        """(r, v, xi, w), (11), [12]."""
        return ca.vertcat(self.position, self.velocity, self.xi, self.angular_velocity)

    @property
    def input(self) -> Expression:
        """Forces of LF, RF, LH, RH, (6), [12]."""
        return ca.vertcat(*self.forces)

    @property
    def motion(self) -> Motion:
        """What holonomic rows are over."""
        return Motion(self.position, self.rotation, self.velocity, self.angular_velocity)

    def push(self, force: Expression, point: Expression) -> None:
        """A force [3] at a `point` [3], both in the world."""
        self.force += force
        self.torque += self.rotation.T @ ca.cross(point - self.position, force)

    def acceleration(self) -> Expression:
        """f_net / m - g, world axes, m/s^2, [3]."""
        return self.force / self.mass + ca.SX(GRAVITY)

    def angular_acceleration(self) -> Expression:
        """I^-1 (R' tau_net - w x I w), body axes, rad/s^2, [3]."""
        gyroscopic = ca.cross(self.angular_velocity, self.inertia * self.angular_velocity)
        return (self.torque - gyroscopic) / self.inertia

    def derivative(self) -> Expression:
        """d(r, v, xi, w)/dt, (8). To first order, d xi/dt = w + xi x w / 2."""
        w = self.angular_velocity
        turning = w + ca.cross(self.xi, w) / 2
        parts = (self.velocity, self.acceleration(), turning, self.angular_acceleration())
        return ca.vertcat(*parts) + self.influence


@dataclass(frozen=True)
class RobotModule:
    """Adds a robot's states; forward Euler as in (13), stated when all wrenches are known.

    Parameters added: `<name>.mass`, `<name>.inertia` [3], `<name>.rotation` [3, 3] (R_op),
    `<name>.desired` [12] and `<name>.weight` [12] (diagonals of Q, and of P at the last knot).

    Attributes:
        name: prefix.
        mass: kg, positive.
        inertia: principal moments, kg m^2, [3], positive.
    """

    name: str
    mass: float
    inertia: Sequence[float]

    def add_to(self, problem: Problem) -> Robot:
        """Adds states, dynamics and tracking cost; returns the handle."""
        name = self.name
        mass = checks.positive(f"{name}.mass", self.mass)
        inertia = checks.positive_array(f"{name}.inertia", self.inertia, 3)
        robot = Robot(
            name=name,
            position=problem.state(f"{name}.r", 3),
            velocity=problem.state(f"{name}.v", 3),
            xi=problem.state(f"{name}.xi", 3),
            angular_velocity=problem.state(f"{name}.w", 3),
            operating_rotation=problem.parameter(f"{name}.rotation", (3, 3), default=np.eye(3)),
            mass=problem.parameter(f"{name}.mass", default=mass),
            inertia=problem.parameter(f"{name}.inertia", 3, default=inertia),
        )
        for i, symbol in enumerate(ca.vertsplit(robot.state, 3)):
            problem.dynamics(symbol, increment=_euler(problem, robot, i))
        desired = problem.parameter(f"{name}.desired", STATE)
        weight = problem.parameter(f"{name}.weight", STATE, default=1.0)
        problem.residual(f"{name}.tracking", robot.state - desired, weight=weight, at="all")
        return robot


def _euler(problem: Problem, robot: Robot, part: int) -> Callable[[], Expression]:
    return lambda: problem.dt * robot.derivative()[3 * part : 3 * part + 3]
