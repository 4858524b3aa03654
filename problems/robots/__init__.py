"""Published facts of the robots: Laikago, A1, Aliengo, and the DynaArm that they carry."""

from pathlib import Path

from palanquin.errors import ProblemError
from palanquin.problems.robots.model import (
    FEET,
    Arm,
    ArmModel,
    Joint,
    Link,
    QuadrupedModel,
    SingleRigidBody,
    load_arm,
    load_quadruped,
)
from palanquin.problems.robots.motors import ArmMotors, LegMotors, Motors

_FOLDER = Path(__file__).parent

LAIKAGO = load_quadruped(_FOLDER / "laikago.json")
A1 = load_quadruped(_FOLDER / "a1.json")
ALIENGO = load_quadruped(_FOLDER / "aliengo.json")
DYNAARM = load_arm(_FOLDER / "dynaarm.json")

QUADRUPEDS = {model.name: model for model in (LAIKAGO, A1, ALIENGO)}


def quadruped(name: str) -> QuadrupedModel:
    """The quadruped called `name`; raises ProblemError that lists the known ones."""
    try:
        return QUADRUPEDS[name]
    except KeyError:
        known = ", ".join(sorted(QUADRUPEDS))
        raise ProblemError(f"robot: {name!r} is not known; known are {known}") from None


__all__ = [
    "A1",
    "ALIENGO",
    "DYNAARM",
    "FEET",
    "LAIKAGO",
    "QUADRUPEDS",
    "Arm",
    "ArmModel",
    "ArmMotors",
    "Joint",
    "LegMotors",
    "Link",
    "Motors",
    "QuadrupedModel",
    "SingleRigidBody",
    "quadruped",
]
