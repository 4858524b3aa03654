"""Robots in a row behind a beam, however many."""

from __future__ import annotations

from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.payload import Box
from palanquin.sim.scenarios.scenario import MOST_ROBOTS, Scenario

SPACING = 1.2
"""Between two robots, m: Table I of De Vincenti and Coros has the grasps at y = -0.6 and 0.6."""

OVERHANG = 0.4
"""Of the beam beyond the outer grasps, m."""


def with_robots(scenario: Scenario, count: int) -> Scenario:
    """The scenario with `count` robots like its first one, in a row behind a beam as thick as its
    payload and long enough; pushes and gait changes of a robot that is gone are dropped.

    Raises InputError for a number that is not from 1 to 4.
    """
    if not 1 <= count <= MOST_ROBOTS:
        raise InputError(f"robots: {count} must be from 1 to {MOST_ROBOTS}")
    names = ("left", "right") if count == 2 else tuple(f"robot{i + 1}" for i in range(count))
    x, _, z = scenario.robots[0].attach
    robots = [
        scenario.robots[0].changed(
            name=name, yaw=0.0, attach=(x, SPACING * ((count - 1) / 2 - i), z)
        )
        for i, name in enumerate(names)
    ]
    thickness, _, depth = scenario.payload.shape.extents
    beam = Box(type="box", size=(thickness, SPACING * (count - 1) + 2 * OVERHANG, depth))
    there = {"payload", *names}
    return scenario.changed(
        robots=robots,
        payload=scenario.payload.model_copy(update={"shape": beam}),
        pushes=[push for push in scenario.pushes if push.body in there],
        gait_changes=[c for c in scenario.gait_changes if there.issuperset(c.robots)],
    )
