"""Robots holonomically constrained to each other by bars (see README.md)."""

from palanquin.problems.layered.bar import Bar
from palanquin.problems.layered.centralized import CentralizedPlanner, NominalPlanner
from palanquin.problems.layered.distributed import DistributedPlanner
from palanquin.problems.layered.interconnected import (
    A1_MASS,
    COMPOSITE_INERTIA,
    TRUNK_INERTIA,
    Team,
    build_interconnected,
)
from palanquin.problems.layered.link import LinkSettings
from palanquin.problems.layered.planner import Desired, LayeredPlan, Planner, RobotStates
from palanquin.problems.layered.settings import PRINTED, VARIANTS, WORKING, LayeredSettings

__all__ = [
    "A1_MASS",
    "COMPOSITE_INERTIA",
    "PRINTED",
    "TRUNK_INERTIA",
    "VARIANTS",
    "WORKING",
    "Bar",
    "CentralizedPlanner",
    "Desired",
    "DistributedPlanner",
    "LayeredPlan",
    "LayeredSettings",
    "LinkSettings",
    "NominalPlanner",
    "Planner",
    "RobotStates",
    "Team",
    "build_interconnected",
]
