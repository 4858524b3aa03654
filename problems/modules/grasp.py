"""A robot's hand fixed to a payload, and the wrench between them.

Equations (2), (3), (8b) and (13b) of De Vincenti and Coros.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palanquin.problem import Expression, Problem
from palanquin.problems import checks
from palanquin.problems.modules.families import Family, register
from palanquin.problems.modules.held_input import held_input
from palanquin.problems.modules.limits import REACH_POLICY, smooth_norm
from palanquin.problems.modules.quadruped import Quadruped
from palanquin.problems.modules.rigid_body import Body
from palanquin.problems.modules.tracking import Tracking

ARM = register(Family("arm", REACH_POLICY))


@dataclass(frozen=True, eq=False)
class Hand:
    """Handle of a grasp.

    Attributes:
        payload: the body that is held.
        robot: who holds it.
        attach: grasp point in the payload's frame by default, m, [3].
        yaw: the robot's reference heading relative to the payload's, rad.
        force: what the payload exerts on the hand, world axes, N, [3].
        torque: moment that the payload exerts on the hand, world axes, N m, [3].
        position: of the grasp point in the world, m, [3].
    """

    payload: Body
    robot: Quadruped
    attach: np.ndarray
    yaw: float
    force: Expression
    torque: Expression
    position: Expression


class Grasp:
    """Fixes a robot's hand to a point of the payload (the hand's position is p_0 + R_0 attach).

    Adds the inputs `<robot>.hand.force` and `<robot>.hand.torque` and the parameters
    `<robot>.attach` [3], `<robot>.arm_base` [3], `<robot>.arm_length`, `<robot>.weight.hand_force`
    and `.hand_torque` [3]. A payload that has no `Tracking` yet gets one with the robot's weights.

    Args:
        payload: handle of the payload.
        robot: handle of the robot.
        attach: grasp point in the payload's frame, m, [3].
        yaw: the robot's reference heading relative to the payload's, rad.
    """

    def __init__(
        self,
        payload: Body,
        robot: Quadruped,
        attach: Sequence[float],
        yaw: float = 0.0,
    ) -> None:
        self.payload = payload
        self.robot = robot
        self.attach = checks.array(f"{robot.name}.attach", attach, 3)
        self.yaw = checks.finite(f"{robot.name}.yaw", yaw)

    def add_to(self, problem: Problem) -> Hand:
        """Adds the wrench, the arm's reach and the wrench's regularisation."""
        robot, payload, name = self.robot.body, self.payload, self.robot.name
        model, weights = self.robot.model, self.robot.weights
        if all(p.name != f"{payload.name}.reference.position" for p in problem.parameters):
            problem.add(Tracking(payload, weights, importance=weights.payload))
        attach = problem.parameter(f"{name}.attach", 3, self.attach)
        base = problem.parameter(f"{name}.arm_base", 3, model.arm)
        length = problem.parameter(f"{name}.arm_length", default=model.arm_length)
        force_weight = problem.parameter(f"{name}.weight.hand_force", 3, weights.force)
        torque_weight = problem.parameter(f"{name}.weight.hand_torque", 3, weights.torque)
        force = held_input(problem, f"{name}.hand.force", self.robot.hold)
        torque = held_input(problem, f"{name}.hand.torque", self.robot.hold)

        payload_arm = payload.offset(attach)
        hand = payload.position + payload_arm - robot.position  # r_h
        robot.apply(force, arm=hand, torque=torque)  # (2)
        payload.apply(-force, arm=payload_arm, torque=-torque)  # (3)
        reach = smooth_norm(hand - robot.offset(base)) - length
        problem.inequality("arm", reach, policy=ARM.policy, robot=name, limb="hand")  # (8b)
        problem.residual(f"{name}.hand.force", force, weight=force_weight)  # (13b)
        problem.residual(f"{name}.hand.torque", torque, weight=torque_weight)
        position = payload.position + payload_arm
        return Hand(payload, self.robot, self.attach, self.yaw, force, torque, position)
