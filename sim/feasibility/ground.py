"""Can feet stand on the slopes, and step over the ditches?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from palanquin.schema import Path
from palanquin.sim.feasibility.finding import Finding, doubt
from palanquin.sim.feasibility.reach import reference_height
from palanquin.sim.scenarios.ditches import RandomDitches
from palanquin.sim.scenarios.robot import Robot
from palanquin.sim.scenarios.route import foothold_route
from palanquin.sim.scenarios.scenario import Scenario

_NEAR_LIMIT = 0.95


def slopes_to_stand_on(scenario: Scenario) -> Iterator[Finding]:
    """No slope on the way exceeds the friction coefficient."""
    points = foothold_route(scenario)
    slopes = np.linalg.norm(scenario.ground.gradient(points[:, 0], points[:, 1]), axis=-1)
    at = int(slopes.argmax())
    slope, friction = float(slopes[at]), scenario.planner.friction
    place = f"at ({points[at, 0]:.2f}, {points[at, 1]:.2f}) m"
    angle = np.degrees(np.arctan(slope))
    if slope > friction * (1 + 1e-9):
        yield Finding(
            ("terrain",),
            f"the slope {place} is {slope:.2f} ({angle:.1f} degrees), over the friction limit: "
            f"whatever stands there slides with a coefficient of {friction:g}",
        )
    elif slope > _NEAR_LIMIT * friction:
        yield doubt(
            ("terrain",),
            f"the slope {place} is {slope:.2f} ({angle:.1f} degrees), at the friction limit of "
            f"{friction:g}: nothing is left for moving",
        )


def longest_step(scenario: Scenario, robot: Robot) -> float:
    """How far apart two footholds of a leg can be while the hip passes over them, m: both at full
    reach, one in front and one behind.
    """
    hip = reference_height(scenario, robot) + robot.body.hips[0][2]
    return 2 * float(np.sqrt(max(robot.body.leg_length**2 - hip**2, 0.0)))


def ditches_to_step_over(scenario: Scenario) -> Iterator[Finding]:
    """No ditch is wider than the longest step of any robot."""
    robot = min(scenario.robots, key=lambda robot: longest_step(scenario, robot))
    step = longest_step(scenario, robot)
    ditches = scenario.ditches
    if isinstance(ditches, RandomDitches):
        widths: dict[Path, float] = {("ditches", "widest"): ditches.widest}
    else:
        widths = {("ditches", "lines", i, "d"): line.d for i, line in enumerate(ditches.lines)}
    for path, width in widths.items():
        if width > step:
            yield Finding(
                path,
                f"a ditch of {100 * width:.0f} cm is wider than a step: {robot.name} reaches "
                f"{100 * step:.0f} cm at this height",
            )
