"""What an arm's motors can give, as limits of the wrench at a hand.

An arm of yaw, shoulder, elbow and roll (DynaArm), its elbow up, at rest: the torques that bear the
payload's wrench on the hand and the arm's own weight, in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from palanquin import quaternion
from palanquin.problem import Expression, Problem
from palanquin.problems import checks
from palanquin.problems.modules.families import Family, limit, register
from palanquin.problems.modules.grasp import Hand
from palanquin.problems.modules.leg_torque import motors_of
from palanquin.problems.modules.limits import TORQUE_POLICY, TORQUE_UNIT
from palanquin.problems.modules.rigid_body import GRAVITY
from palanquin.problems.modules.two_links import bend

_TINY = 1e-9  # m^2


@dataclass(frozen=True)
class ArmTorque:
    """Limits of what arms bear: a `share` of the efforts that their motors' maker states.

    Raises ProblemError unless it is positive.
    """

    share: float = limit(1.0, "of the efforts in the arm's description")

    def __post_init__(self) -> None:
        checks.positive("arm torque: share", self.share)


def add_arm_torques(problem: Problem, limits: ArmTorque) -> None:
    """Rows of family `arm_torque` for every grasp: yaw, shoulder, elbow and roll, both ways.

    Parameters of each robot: `<robot>.shoulder` [3], `<robot>.arm_links` [8] (upper arm, m; hand
    forward and up from the elbow, m; mass and centre of the upper arm, mass and centre of the
    forearm, kg and m) and `<robot>.arm_torque_limits` [4], N m.
    """
    for hand in problem.handles(Hand):
        name, arm = hand.robot.name, motors_of(hand.robot).arm
        shoulder = problem.parameter(f"{name}.shoulder", 3, arm.shoulder)
        lengths, masses = (arm.upper, *arm.hand), (arm.upper_mass, arm.upper_centre)
        links = problem.parameter(
            f"{name}.arm_links", 8, (*lengths, *masses, arm.fore_mass, *arm.fore_centre)
        )
        most = problem.parameter(
            f"{name}.arm_torque_limits", 4, [limits.share * e for e in arm.efforts]
        )
        torques = arm_torques(hand, shoulder, links)
        rows = ca.vertcat(torques - most, -torques - most) / TORQUE_UNIT
        options = {"scale": TORQUE_UNIT, "robot": name, "limb": "hand"}
        problem.inequality("arm_torque", rows, ARM_TORQUE.policy, **options)


ARM_TORQUE = register(
    Family(
        "arm_torque",
        TORQUE_POLICY,
        TORQUE_UNIT,
        option="arm_torque",
        limits=ArmTorque,
        add=add_arm_torques,
        meaning="limits of the torques with which motors of arms bear",
    )
)


def arm_torques(hand: Hand, shoulder: Expression, links: Expression) -> Expression:
    """Torques of yaw, shoulder, elbow and roll that bear the wrench at a hand, N m, [4].

    Args:
        hand: of the arm.
        shoulder: where the yaw axis and the shoulder's meet, in the robot's frame, m, [3].
        links: as of `add_arm_torques`, [8].
    """
    upper, hand_x, hand_z, upper_mass, upper_centre, fore_mass, fore_x, fore_z = ca.vertsplit(links)
    body = hand.robot.body

    def in_body(v: Expression) -> Expression:
        return quaternion.rotate_inverse(body.orientation, v)

    reach = in_body(hand.position - body.position) - shoulder
    # The arm's plane: r away from the yaw axis, z along it, and the pitch axis across.
    out = ca.sqrt(reach[0] ** 2 + reach[1] ** 2 + _TINY)
    cos, sin = reach[0] / out, reach[1] / out

    def in_plane(v: Expression) -> Expression:
        return ca.vertcat(cos * v[0] + sin * v[1], cos * v[1] - sin * v[0], v[2])

    force, moment = in_plane(in_body(hand.force)), in_plane(in_body(hand.torque))
    weight = in_plane(in_body(ca.SX(GRAVITY)))

    end = (out, reach[2])
    fore = ca.sqrt(hand_x**2 + hand_z**2)
    elbow_r, elbow_z = bend(end, upper, fore, side=1)
    # The forearm's axis (its z) and the direction of its x, from where elbow and hand are.
    line_r, line_z = (out - elbow_r) / fore**2, (reach[2] - elbow_z) / fore**2
    axis_r, axis_z = hand_z * line_r + hand_x * -line_z, hand_z * line_z + hand_x * line_r

    def pitch(r: Expression, z: Expression, f: Expression) -> Expression:
        """Moment about the pitch axis (y) of a force at (r, z)."""
        return z * f[0] - r * f[2]

    fore_r = fore_x * axis_z + fore_z * axis_r  # centre of the forearm, from the elbow
    fore_h = fore_z * axis_z - fore_x * axis_r
    share = upper_centre / upper
    forearm = fore_mass * pitch(fore_r, fore_h, weight)
    at_elbow = pitch(out - elbow_r, reach[2] - elbow_z, force) + moment[1] + forearm
    own = (share * upper_mass + fore_mass) * pitch(elbow_r, elbow_z, weight)
    at_shoulder = pitch(out, reach[2], force) + moment[1] + own + forearm
    sideways = out * force[1] + moment[2]
    sideways += (share * upper_mass + fore_mass) * elbow_r * weight[1] + (
        fore_mass * fore_r * weight[1]
    )
    along = axis_r * moment[0] + axis_z * moment[2]
    return -ca.vertcat(sideways, at_shoulder, at_elbow, along)
