"""A quadruped as a rigid body on four massless legs (section III of De Vincenti and Coros)."""

from __future__ import annotations

from dataclasses import dataclass

from palanquin.problem import Expression, Problem
from palanquin.problems import checks
from palanquin.problems.gaits import Gait
from palanquin.problems.modules.leg import Foot, Leg
from palanquin.problems.modules.rigid_body import Body, RigidBody
from palanquin.problems.modules.tracking import Tracking
from palanquin.problems.modules.weights import TABLE_I, Weights
from palanquin.problems.robots import (
    DYNAARM,
    FEET,
    Arm,
    Motors,
    QuadrupedModel,
    SingleRigidBody,
)


@dataclass(frozen=True, eq=False)
class Quadruped:
    """Handle of a quadruped: its body, its feet (LF, RF, LH, RH) and what it was made from; `hold`
    is the flag of knots at which its inputs keep their value, if they may.
    """

    name: str
    body: Body
    feet: tuple[Foot, ...]
    model: SingleRigidBody
    weights: Weights
    gait: Gait | None
    hold: Expression | None = None
    motors: Motors | None = None


class ArmedQuadruped:
    """A legged robot whose arm, once a `Grasp` is added, holds a payload.

    Parameters added, besides those of `RigidBody` and `Tracking`: `<name>.hips` [4, 3],
    `<name>.leg_length`, the flags `<name>.contact` [4] and `<name>.previous_contact` [4] (of the
    knot before), `<name>.reference.footholds` [4, 3], `<name>.weight.foothold` [3] and
    `<name>.weight.force` [3]. Feet are ordered LF, RF, LH, RH.

    Args:
        name: the robot's name, prefix of all its blocks and parameters.
        model: a robot of `palanquin.problems.robots`, or its lumped rigid body.
        gait: gait that planners give it unless told otherwise.
        arm: "massless" as in the paper, or "dynaarm" with the arm's inertia; for robots.
        weights: default weights.
        holds_inputs: whether forces of feet and hand may keep their value for several knots: adds
            the flag `<name>.hold`, which must be 0 at the first knot.
        motors: what moves it, for limits of torques; a robot's own with a DynaArm unless told.
    """

    def __init__(
        self,
        name: str,
        model: QuadrupedModel | SingleRigidBody,
        gait: Gait | None = None,
        arm: Arm = "massless",
        weights: Weights = TABLE_I,
        holds_inputs: bool = False,
        motors: Motors | None = None,
    ) -> None:
        self.name = name
        if isinstance(model, QuadrupedModel):
            motors = motors or model.motors(DYNAARM, arm)
            model = model.single_rigid_body(arm)
        self.model, self.motors = model, motors
        self.gait = gait
        self.weights = weights
        self.holds_inputs = holds_inputs
        checks.positive(f"{name}.leg_length", self.model.leg_length)
        checks.positive(f"{name}.arm_length", self.model.arm_length)
        checks.array(f"{name}.hips", self.model.hips, 4, 3)

    def add_to(self, problem: Problem) -> Quadruped:
        """Adds body, tracking cost and legs."""
        name, model, weights = self.name, self.model, self.weights
        body = problem.add(RigidBody(name, model.mass, model.inertia))
        problem.add(Tracking(body, weights))
        hips = problem.parameter(f"{name}.hips", (4, 3), model.hips)
        length = problem.parameter(f"{name}.leg_length", default=model.leg_length)
        contact = problem.parameter(f"{name}.contact", 4, 1.0)
        previous_contact = problem.parameter(f"{name}.previous_contact", 4, 1.0)
        # The default foothold is where the hip is over the ground in the standing pose.
        below = [(x, y, -model.standing_height) for x, y, _ in model.hips]
        reference = problem.parameter(f"{name}.reference.footholds", (4, 3), below)
        foothold_weight = problem.parameter(f"{name}.weight.foothold", 3, weights.foothold)
        force_weight = problem.parameter(f"{name}.weight.force", 3, weights.force)
        hold = problem.parameter(f"{name}.hold") if self.holds_inputs else None
        feet = tuple(
            problem.add(
                Leg(
                    body=body,
                    limb=limb,
                    hip=hips[f, :].T,
                    length=length,
                    contact=contact[f],
                    previous_contact=previous_contact[f],
                    reference=reference[f, :].T,
                    foothold_weight=foothold_weight,
                    force_weight=force_weight,
                    hold=hold,
                )
            )
            for f, limb in enumerate(FEET)
        )
        return Quadruped(name, body, feet, model, weights, self.gait, hold, self.motors)
