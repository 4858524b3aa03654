"""A leg: foothold and ground reaction force, switched by contact flags.

Equations (7), (8a) and (13a) of De Vincenti and Coros. The paper's variable is the foot's position
relative to the body, r_f; ours is its world position P_f = p + r_f, because a standing foot then
keeps its value and needs no variable at all.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from palanquin.errors import ProblemError
from palanquin.problem import Chart, Expression, Problem, Role
from palanquin.problems.modules.families import Family, register
from palanquin.problems.modules.ground import Ground
from palanquin.problems.modules.held_input import held_input
from palanquin.problems.modules.limits import REACH_POLICY, smooth_norm
from palanquin.problems.modules.rigid_body import Body

LEG = register(Family("leg", REACH_POLICY))


@dataclass(eq=False)
class Foot:
    """Handle of a leg's foot at one knot.

    Attributes:
        robot: name of the robot.
        limb: LF, RF, LH or RH.
        position: in the world, m, [3].
        force: ground reaction force, world axes, N, [3]; zero in swing.
        contact: 1 where the foot stands, 0 in swing.
        ground: what it stands on; set by the terrain module.
    """

    robot: str
    limb: str
    position: Expression
    force: Expression
    contact: Expression
    ground: Ground | None = None

    def land(self, xy: Expression) -> Expression:
        """Position on the ground [3] over the coordinates `xy` [2]."""
        if self.ground is None:
            raise ProblemError(
                f"foot {self.limb} of '{self.robot}' has no ground: add Terrain after the robots"
            )
        return ca.vertcat(xy, self.ground.height(xy))


@dataclass(frozen=True)
class Leg:
    """A massless leg between a hip and a point foot.

    Adds the blocks `<robot>.<limb>.foot` and `<robot>.<limb>.force`. A foot that stands since the
    knot before is carried on, lands as a free point of the ground, and in swing is local to its
    knot, where only reach, ditches and the reference foothold see it. Without contact the force is
    absent.

    Attributes:
        body: the robot's body.
        limb: LF, RF, LH or RH.
        hip: where the leg stems from, body axes, m, [3].
        length: reach l_f, m.
        contact: flag s_{k,f} of this knot.
        previous_contact: flag s_{k-1,f} of the knot before.
        reference: reference foothold r_f*, relative to the body's position, world axes, m, [3].
        foothold_weight: W_r, [3].
        force_weight: W_f, [3].
        hold: flag of knots at which forces keep their value; None where they never do.
    """

    body: Body
    limb: str
    hip: Expression
    length: Expression
    contact: Expression
    previous_contact: Expression
    reference: Expression
    foothold_weight: Expression
    force_weight: Expression
    hold: Expression | None = None

    def add_to(self, problem: Problem) -> Foot:
        """Adds blocks, reach and regularisation; returns the foot. Its role and its chart say (7)
        and (6).
        """
        body, name = self.body, f"{self.body.name}.{self.limb}"
        contact, standing = self.contact, self.contact * self.previous_contact
        owner = {"robot": body.name, "limb": self.limb}
        role = ca.if_else(
            contact, ca.if_else(standing, Role.CARRIED, Role.INPUT), Role.LOCAL
        )  # (7)
        # The chart asks for the ground only when the problem is lowered: terrain comes later.
        chart = Chart(2, embed=lambda xy: foot.land(xy), active=contact)
        foot = Foot(
            robot=body.name,
            limb=self.limb,
            position=problem.variable(f"{name}.foot", 3, role=role, chart=chart),
            force=held_input(
                problem, f"{name}.force", self.hold, exists=contact, existed=self.previous_contact
            ),
            contact=contact,
        )
        r = foot.position - body.position
        body.apply(contact * foot.force, arm=r)  # (2)
        reach = smooth_norm(r - body.offset(self.hip)) - self.length
        problem.inequality("leg", reach, policy=LEG.policy, **owner)  # (8a)
        problem.residual(f"{name}.foothold", r - self.reference, weight=self.foothold_weight)
        problem.residual(f"{name}.force", foot.force, weight=self.force_weight)  # (13a)
        return foot
