"""Robots in scenarios."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, Field

from palanquin.problems import clm
from palanquin.problems.robots import DYNAARM, QUADRUPEDS, Arm, SingleRigidBody, quadruped
from palanquin.schema import Finite, Strict
from palanquin.sim.scenarios.gait import GaitChoice
from palanquin.sim.scenarios.team import Member
from palanquin.sim.scenarios.vectors import Name, Vector

Model = Annotated[
    str,
    AfterValidator(lambda name: quadruped(name).name),
    Field(json_schema_extra={"enum": sorted(QUADRUPEDS)}),
]


class Robot(Strict):
    """A quadruped with an arm that holds the payload."""

    name: Name
    model: Model = Field("laikago", description=", ".join(sorted(QUADRUPEDS)))
    arm: Arm = Field(
        "massless", description="massless, as in the paper's Table I, or dynaarm with its 7.4 kg"
    )
    attach: Vector = Field(description="grasp point in the payload's frame, m")
    yaw: Finite = Field(0.0, description="heading relative to the payload's, rad")
    gait: GaitChoice = Field(GaitChoice(name="trot"), description="how it walks from the start")

    @property
    def body(self) -> SingleRigidBody:
        """The robot with its arm as one rigid body."""
        return quadruped(self.model).single_rigid_body(self.arm)

    def carrier(self) -> clm.Carrier:
        """The robot as the planner knows it."""
        motors = quadruped(self.model).motors(DYNAARM, self.arm)
        return clm.Carrier(self.name, self.attach, self.body, self.yaw, self.gait.gait, motors)

    def member(self) -> Member:
        """The robot as the scene shows it."""
        return Member(self.name, self.model, self.attach, self.yaw, self.body)

    def changed(self, **fields: Any) -> Robot:
        """A copy with other values."""
        return type(self).model_validate({**dict(self), **fields})
