"""Can the robots hold the payload at its height, standing on level ground?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from palanquin.problems.robots import SingleRigidBody
from palanquin.sim.feasibility.finding import Finding, doubt
from palanquin.sim.scenarios.robot import Robot
from palanquin.sim.scenarios.scenario import Scenario

# How low a trunk may hang: below that it lies on the ground, m.
_LOWEST_TRUNK = 0.12


def reference_height(scenario: Scenario, robot: Robot) -> float:
    """Height of the robot's centre of mass over level ground with its hand as by default (14a)."""
    return scenario.payload.height + robot.attach[2] - robot.body.hand[2]


def heights_to_hold(scenario: Scenario) -> Iterator[Finding]:
    """There is a height of the trunk at which both the feet reach the ground below the hips and
    the hand reaches its grasp.
    """
    for i, robot in enumerate(scenario.robots):
        body, wanted = robot.body, reference_height(scenario, robot)
        highest = body.leg_length - body.hips[0][2]
        if _LOWEST_TRUNK <= wanted <= highest:
            continue
        grasp = scenario.payload.height + robot.attach[2]
        standing = float(np.clip(wanted, _LOWEST_TRUNK, highest))
        short = _stretch(body, grasp - standing) - body.arm_length
        where = "high" if wanted > highest else "low"
        if short > 0:
            yield Finding(
                ("robots", i, "attach"),
                f"the grasp of {robot.name} is {grasp:.2f} m {where}, {100 * short:.0f} cm out of "
                f"its arm's reach of {body.arm_length:g} m with the trunk at {standing:.2f} m",
            )
        else:
            yield doubt(
                ("payload", "height"),
                f"with its hand as by default, {robot.name} would stand at {wanted:.2f} m; its "
                f"legs allow {_LOWEST_TRUNK} to {highest:.2f} m, so its arm has to make up for it",
            )


def _stretch(body: SingleRigidBody, rise: float) -> float:
    """Distance from the arm's base to a grasp `rise` over the centre of mass, m, where the hand is
    as far in front of the robot as by default.
    """
    forward, left = np.subtract(body.hand[:2], body.arm[:2])
    return float(np.linalg.norm([forward, left, rise - body.arm[2]]))
