"""Where a robot's motors sit and what they can give, as rows of torques need it.

Positions in the frame of the robot's lumped rigid body, relative to its centre of mass.
"""

from __future__ import annotations

from dataclasses import dataclass

Vector = tuple[float, ...]


@dataclass(frozen=True)
class LegMotors:
    """Of four legs that roll about x, then pitch about y twice (LF, RF, LH, RH).

    `roll_axes` [4][3] are points of the first axes, m. Once a leg has rolled, its pitch axes are
    `sideways` m further out (left of the left roll axes), its `thigh` and `calf` (m, to the centre
    of the foot, a ball of `foot_radius`) beneath. `efforts` [3]: of roll, thigh and knee, N m.
    """

    roll_axes: tuple[Vector, ...]
    sideways: float
    thigh: float
    calf: float
    foot_radius: float
    efforts: Vector


@dataclass(frozen=True)
class ArmMotors:
    """Of an arm that turns about z, pitches at shoulder and elbow, and rolls along its forearm.

    The first two axes meet in `shoulder` [3], m. Along the upper arm it is `upper` m to the elbow;
    from there, with the forearm upright, the hand is at `hand` [2], m forward and up, on the roll
    axis. Moving parts weigh `upper_mass` kg at `upper_centre` m along the upper arm and `fore_mass`
    at `fore_centre` [2], as `hand`. `efforts` [4]: of yaw, shoulder, elbow and roll, N m.
    """

    shoulder: Vector
    upper: float
    hand: Vector
    upper_mass: float
    upper_centre: float
    fore_mass: float
    fore_centre: Vector
    efforts: Vector


@dataclass(frozen=True)
class Motors:
    """Of a robot's legs and of its arm."""

    legs: LegMotors
    arm: ArmMotors
