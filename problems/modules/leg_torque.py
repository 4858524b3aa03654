"""What the motors of standing legs can give, as limits of ground reaction forces.

De Vincenti and Coros plan with massless legs and friction alone. A leg that stands transmits its
ground reaction F by the torques -J'F, here in closed form: a roll axis along the trunk, then thigh
and calf in the plane that has rolled.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from palanquin import quaternion
from palanquin.errors import ProblemError
from palanquin.problem import Expression, Problem
from palanquin.problems import checks
from palanquin.problems.modules.families import Family, limit, register
from palanquin.problems.modules.leg import Foot
from palanquin.problems.modules.limits import TORQUE_POLICY, TORQUE_UNIT
from palanquin.problems.modules.quadruped import Quadruped
from palanquin.problems.modules.two_links import bend, root
from palanquin.problems.robots import Motors


@dataclass(frozen=True)
class LegTorque:
    """Limits of what standing legs bear: a `share` of the efforts that their motors' maker states.

    Raises ProblemError unless it is positive.
    """

    share: float = limit(1.0, "of the efforts in the robot's description")

    def __post_init__(self) -> None:
        checks.positive("leg torque: share", self.share)


def add_leg_torques(problem: Problem, limits: LegTorque) -> None:
    """Rows of family `leg_torque` for every foot that stands: roll, thigh and knee, both ways.

    Parameters of each robot: `<robot>.roll_axes` [4, 3], `<robot>.leg_links` [4] (sideways, thigh,
    calf, radius of the foot, m) and `<robot>.leg_torque_limits` [3], N m. Feet have their ground.
    """
    for robot in problem.handles(Quadruped):
        legs = motors_of(robot).legs
        axes = problem.parameter(f"{robot.name}.roll_axes", (4, 3), legs.roll_axes)
        links = problem.parameter(
            f"{robot.name}.leg_links", 4, (legs.sideways, legs.thigh, legs.calf, legs.foot_radius)
        )
        most = problem.parameter(
            f"{robot.name}.leg_torque_limits", 3, [limits.share * e for e in legs.efforts]
        )
        for f, foot in enumerate(robot.feet):
            side = 1 if foot.limb[0] == "L" else -1
            torques = leg_torques(robot, foot, axes[f, :].T, side, links)
            rows = ca.vertcat(torques - most, -torques - most) / TORQUE_UNIT
            problem.inequality(
                "leg_torque",
                rows,
                LEG_TORQUE.policy,
                active=foot.contact,
                scale=TORQUE_UNIT,
                robot=robot.name,
                limb=foot.limb,
            )


LEG_TORQUE = register(
    Family(
        "leg_torque",
        TORQUE_POLICY,
        TORQUE_UNIT,
        option="leg_torque",
        limits=LegTorque,
        add=add_leg_torques,
        meaning="limits of the torques with which motors of standing legs bear",
    )
)


def motors_of(robot: Quadruped) -> Motors:
    """A robot's motors; raises ProblemError for one that does not say where they are."""
    if robot.motors is None:
        raise ProblemError(f"robot '{robot.name}' has no motors that torques could be limited of")
    return robot.motors


def leg_torques(
    robot: Quadruped, foot: Foot, axis: Expression, side: int, links: Expression
) -> Expression:
    """Torques of roll, thigh and knee that bear a standing foot's force, N m, [3].

    Args:
        robot: whose foot.
        foot: where the force acts; the ball's centre is a radius above, along the ground's normal.
        axis: a point of the roll axis in the body's frame, m, [3].
        side: 1 of a left leg, -1 of a right one.
        links: sideways, thigh, calf, radius of the foot, m, [4].
    """
    sideways, thigh, calf, radius = ca.vertsplit(links)
    assert foot.ground is not None
    normal, _, _ = foot.ground.frame(foot.position[:2])

    def in_body(v: Expression) -> Expression:
        return quaternion.rotate_inverse(robot.body.orientation, v)

    x, y, z = ca.vertsplit(in_body(foot.position - robot.body.position) - axis)  # of the force
    ball = radius * in_body(normal)
    force = in_body(foot.force)
    roll = z * force[1] - y * force[2]

    # In the plane that has rolled: the ball is `down` below the pitch axes, its distance from the
    # roll axis to the side is what the hip's link leaves.
    to_side, up = y + ball[1], z + ball[2]
    square = to_side**2 + up**2
    offset = side * sideways
    down = root(square - offset**2)
    cos = (offset * to_side - down * up) / square
    sin = (offset * up + down * to_side) / square
    lift = cos * force[2] - sin * force[1]
    height = cos * z - sin * y  # of the force's point, in that plane
    knee_x, knee_z = bend((x + ball[0], -down), thigh, calf, side=-1)
    pitch = [(x - px) * lift - (height - pz) * force[0] for px, pz in ((0, 0), (knee_x, knee_z))]
    return ca.vertcat(roll, *pitch)
