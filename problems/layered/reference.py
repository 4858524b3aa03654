"""How far references of robots on bars may run ahead of the robots."""

from __future__ import annotations

from dataclasses import dataclass

STANDING_HEIGHT = 0.26
"""Of the centre of mass over the ground, m (V-A.1)."""


@dataclass(frozen=True)
class Leash:
    """How far ahead of its robot a reference (x, y) may be: held back or pushed away, a robot does
    not have to make up for more.

    Attributes:
        length: m.
        in_circle: in any direction; otherwise along each axis of the world.
    """

    length: float
    in_circle: bool = True


def within_circle(radius: float) -> Leash:
    """At most `radius` (m) in any direction."""
    return Leash(radius)


def within_square(half: float) -> Leash:
    """At most `half` (m) along each axis of the world."""
    return Leash(half, in_circle=False)
