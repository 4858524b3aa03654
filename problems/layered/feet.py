"""Ground reaction forces of a robot's stance legs, in their friction pyramids (9)."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from palanquin.policies import Hard
from palanquin.problem import Problem, Role
from palanquin.problems.layered.robot import LIMBS, Robot


@dataclass(frozen=True)
class FeetModule:
    """Adds a force per foot, absent in swing, and its hard rows |f_x|, |f_y| <= mu f_z / sqrt(2)
    and f_min <= f_z <= f_max.

    Parameters added: `<robot>.feet` [4, 3] in the world, `<robot>.contact` [4] flags,
    `<robot>.force_weight` (R_u), `<robot>.friction` (mu) and `<robot>.normal` [2] (bounds, N).
    """

    robot: Robot
    friction: float = 0.6
    force_weight: float = 1e-2
    normal: tuple[float, float] = (0.0, 1e3)

    def add_to(self, problem: Problem) -> None:
        """Adds forces, their cost and rows, and pushes the robot with them."""
        robot, name = self.robot, self.robot.name
        feet = problem.parameter(f"{name}.feet", (4, 3))
        contact = problem.parameter(f"{name}.contact", 4, default=1.0)
        robot.feet, robot.contact = feet, contact
        weight = problem.parameter(f"{name}.force_weight", default=self.force_weight)
        slope = problem.parameter(f"{name}.friction", default=self.friction) / np.sqrt(2)
        bounds = problem.parameter(f"{name}.normal", 2, default=self.normal)
        for i, limb in enumerate(LIMBS):
            block = f"{name}.{limb}.force"
            f = problem.variable(block, 3, ca.if_else(contact[i], Role.INPUT, Role.ABSENT))
            robot.forces.append(f)
            robot.push(contact[i] * f, feet[i, :].T)  # (3)
            problem.residual(block, f, weight=weight)
            cone = slope * f[2]
            pyramid = ca.vertcat(f[0] - cone, -f[0] - cone, f[1] - cone, -f[1] - cone)
            owner = {"robot": name, "limb": limb, "active": contact[i]}
            problem.inequality("friction", pyramid, Hard(), **owner)
            normal = ca.vertcat(bounds[0] - f[2], f[2] - bounds[1])
            problem.inequality("normal", normal, Hard(), **owner)
