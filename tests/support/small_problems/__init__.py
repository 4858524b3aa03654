"""A library of small problems, each with its mathematics and its own check of a solution."""

from .base import Inputs, SmallProblem
from .hopper import Hopper
from .linear import (
    BoundedIntegrator,
    DoubleIntegrator,
    HardBoundedIntegrator,
    MoveBlocking,
    TerminalEquality,
)
from .nonlinear import ConvexCost, LargeResidual, Pendulum, Unicycle
from .rigid_body import RigidBody, Spinner

LIBRARY: dict[str, SmallProblem] = {
    type(p).__name__: p
    for p in (
        DoubleIntegrator(),
        BoundedIntegrator(),
        HardBoundedIntegrator(),
        TerminalEquality(),
        MoveBlocking(),
        Unicycle(),
        Pendulum(),
        LargeResidual(),
        ConvexCost(),
        Spinner(),
        RigidBody(),
        Hopper(),
    )
}

__all__ = ["LIBRARY", "Inputs", "SmallProblem"]
