"""Can the arms hold the payload's weight?"""

from __future__ import annotations

from collections.abc import Iterator

from palanquin.problems.robots import DYNAARM
from palanquin.sim.feasibility.finding import Finding, doubt
from palanquin.sim.scenarios.scenario import Scenario

_GRAVITY = 9.81


def weight_to_hold(scenario: Scenario) -> Iterator[Finding]:
    """An equal share of the weight at the hand's distance loads the shoulder with less than its
    motor gives.
    """
    share = _GRAVITY * scenario.payload.mass / len(scenario.robots)
    limit = DYNAARM.joints["shoulder"].effort
    for robot in scenario.robots:
        moment = share * abs(robot.body.hand[0] - robot.body.arm[0])
        if moment > limit:
            yield doubt(
                ("payload", "mass"),
                f"{scenario.payload.mass:g} kg among {len(scenario.robots)} load the shoulder of "
                f"{robot.name} with {moment:.0f} N m; a DynaArm's motor has {limit:g}",
            )
