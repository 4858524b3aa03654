"""Contact-wrench cones: what a hand can transmit without slipping, twisting or tipping.

After Caron, Pham and Nakamura (ICRA 2015) for a square contact: with the normal force f_n, the
tangential forces are within a friction pyramid, the moment about the normal within what friction
on the pads holds, and the centre of pressure on the pads. De Vincenti and Coros leave such limits
to future work (section IV-C).
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from palanquin import quaternion
from palanquin.problem import Expression, Problem
from palanquin.problems import checks
from palanquin.problems.modules.families import Family, limit, register, values_of
from palanquin.problems.modules.grasp import Hand
from palanquin.problems.modules.limits import FORCE_POLICY, FORCE_UNIT


@dataclass(frozen=True)
class WrenchCone:
    """Limits of a gripper whose pads press on the payload along the hand's x axis.

    The clamping force `grip` (N) adds to the normal force, `friction` is between pads and payload,
    `torsion` the largest moment about the normal per normal force (m), and the centre of pressure
    may be `half_size` (m) from the middle. Raises ProblemError unless all are positive.
    """

    grip: float = limit(300.0, "clamping force, N")
    friction: float = limit(0.6, "coefficient of the pads")
    torsion: float = limit(0.03, "moment about the normal per N, m")
    half_size: float = limit(0.04, "half of the pads' side, m")

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            checks.positive(f"hand cone: {name}", value)

    def values(self) -> list[float]:
        """(grip, friction, torsion, half_size), the run-time parameter."""
        return values_of(self)


def add_hand_cones(problem: Problem, cone: WrenchCone) -> None:
    """Rows of family `hand` for every grasp, with `<robot>.hand.cone` [4] as parameter."""
    for hand in problem.handles(Hand):
        name = hand.robot.name
        limits = problem.parameter(f"{name}.hand.cone", 4, cone.values())
        orientation = hand.payload.orientation
        rows = cone_rows(-hand.force, -hand.torque, orientation, hand.yaw, limits)
        options = {"scale": FORCE_UNIT, "robot": name, "limb": "hand"}
        problem.inequality("hand", rows, HAND.policy, **options)


HAND = register(
    Family(
        "hand",
        FORCE_POLICY,
        FORCE_UNIT,
        option="hand_cone",
        limits=WrenchCone,
        add=add_hand_cones,
        meaning="limits of the wrench at each hand",
    )
)


def cone_rows(
    force: Expression, torque: Expression, orientation: Expression, yaw: float, cone: Expression
) -> Expression:
    """Rows <= 0 in units of 100 N, [11]: normal force, friction, torsion and centre of pressure.

    Args:
        force: of the hand on the payload, world axes, N, [3].
        torque: of the hand on the payload about the grasp point, world axes, N m, [3].
        orientation: of the payload, body to world, [4].
        yaw: heading of the hand relative to the payload, rad.
        cone: values of a `WrenchCone`, [4].
    """
    grip, friction, torsion, half_size = ca.vertsplit(cone)
    cos, sin = ca.cos(yaw), ca.sin(yaw)
    to_hand = ca.blockcat([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
    f = to_hand @ quaternion.rotate_inverse(orientation, force)
    moment = to_hand @ quaternion.rotate_inverse(orientation, torque)
    normal = grip + f[0]
    sideways = ca.vertcat(f[1], f[2]) / friction
    twist = moment[0] / torsion
    tip = ca.vertcat(moment[1], moment[2]) / half_size
    both = ca.vertcat(sideways, twist, tip)
    return ca.vertcat(-normal, both - normal, -both - normal) / FORCE_UNIT
