"""Reusable pieces of problems; `Problem.add` takes them and returns their handles."""

from palanquin.problems.modules.arm_torque import ArmTorque
from palanquin.problems.modules.ditches import Ditches, DitchField
from palanquin.problems.modules.families import FAMILIES, Family, add_options, unit_of
from palanquin.problems.modules.grasp import Grasp, Hand
from palanquin.problems.modules.ground import Ground
from palanquin.problems.modules.leg import Foot, Leg
from palanquin.problems.modules.leg_torque import LegTorque
from palanquin.problems.modules.obstacles import ObstacleField, Obstacles
from palanquin.problems.modules.quadruped import ArmedQuadruped, Quadruped
from palanquin.problems.modules.rigid_body import GRAVITY, Body, RigidBody
from palanquin.problems.modules.terrain import Terrain
from palanquin.problems.modules.tracking import Tracking
from palanquin.problems.modules.weights import TABLE_I, Weights
from palanquin.problems.modules.wrench_cone import WrenchCone

__all__ = [
    "FAMILIES",
    "GRAVITY",
    "TABLE_I",
    "ArmTorque",
    "ArmedQuadruped",
    "Body",
    "DitchField",
    "Ditches",
    "Family",
    "Foot",
    "Grasp",
    "Ground",
    "Hand",
    "Leg",
    "LegTorque",
    "ObstacleField",
    "Obstacles",
    "Quadruped",
    "RigidBody",
    "Terrain",
    "Tracking",
    "Weights",
    "WrenchCone",
    "add_options",
    "unit_of",
]
