"""Laikagos in a row behind a beam, for the planner and for the scene."""

from __future__ import annotations

from palanquin.problems import clm
from palanquin.problems.gaits import Gait
from palanquin.problems.robots import LAIKAGO
from palanquin.sim.errors import InputError
from palanquin.sim.team import Member, Payload, Team

SPACING = 1.2
"""Between two robots, m: Table I of De Vincenti and Coros has the grasps at y = -0.6 and 0.6."""

OVERHANG = 0.4
"""Of the beam beyond the outer grasps, m."""

MOST_ROBOTS = 4


def check_size(robots: int) -> None:
    """Raises InputError unless so many robots can carry the beam."""
    if not 1 <= robots <= MOST_ROBOTS:
        raise InputError(f"robots: {robots} must be from 1 to {MOST_ROBOTS}")


def grasps(robots: int) -> dict[str, tuple[float, float, float]]:
    """Grasp points in the payload's frame by the robots' names, m, from left to right."""
    names = ("left", "right") if robots == 2 else tuple(f"robot{i + 1}" for i in range(robots))
    return {name: (0.0, SPACING * ((robots - 1) / 2 - i), 0.0) for i, name in enumerate(names)}


def planning_team(robots: int, gait: Gait) -> clm.Team:
    """The team of Table I of De Vincenti and Coros, with so many robots."""
    carriers = (clm.Carrier(name, attach, gait=gait) for name, attach in grasps(robots).items())
    return clm.Team(clm.Payload(), tuple(carriers))


def scene_team(robots: int) -> Team:
    """The same team as the scene describes it."""
    beam = Payload(clm.Payload().mass, (0.08, SPACING * (robots - 1) + 2 * OVERHANG, 0.08))
    members = (Member(name, LAIKAGO.name, attach) for name, attach in grasps(robots).items())
    return Team(tuple(members), beam)
