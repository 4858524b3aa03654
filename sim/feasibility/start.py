"""Can the team stand where it begins?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from palanquin.problems import quaternions
from palanquin.problems.clm.references import ORIENTATION, POSITION
from palanquin.problems.foothold_areas import FootholdAreas
from palanquin.problems.robots import FEET
from palanquin.sim.feasibility.finding import Finding, doubt
from palanquin.sim.feasibility.obstacles import distances
from palanquin.sim.scenarios.scenario import Scenario


def feet_at_the_start(scenario: Scenario) -> Iterator[Finding]:
    """No foot begins in a ditch, beside the ground that may be stood on, or in an obstacle; and
    none out of its leg's reach.
    """
    state = scenario.start_state()
    for r, robot in enumerate(scenario.robots):
        axes = quaternions.matrix(state.bodies[1 + r, ORIENTATION])
        hips = state.bodies[1 + r, POSITION] + np.array(robot.body.hips) @ axes.T
        for f, foot in enumerate(state.feet[r]):
            who = f"{FEET[f]} of {robot.name} begins at ({foot[0]:.2f}, {foot[1]:.2f}) m, "
            for place in _bad_places(scenario, foot):
                yield Finding(("start_pose",), who + place)
            length = float(np.linalg.norm(hips[f] - foot))
            if length > robot.body.leg_length:
                yield doubt(
                    ("start_pose",),
                    f"{who}{length:.2f} m from its hip; the leg reaches "
                    f"{robot.body.leg_length:g} m",
                )


def _bad_places(scenario: Scenario, foot: np.ndarray) -> Iterator[str]:
    """What a foot [3] must not stand in."""
    x, y, _ = foot
    for a, b, c, width in scenario.ditch_lines:
        if abs(a * x + b * y + c) / np.hypot(a, b) < width / 2:
            yield f"in the ditch along {a:g} x + {b:g} y + {c:g} = 0"
    ground = scenario.ground
    if isinstance(ground, FootholdAreas) and (miss := float(ground.outside(foot))) > 0:
        yield f"{100 * miss:.0f} cm beside the ground where feet may stand"
    for j, obstacle in enumerate(scenario.obstacles):
        if distances(np.array(obstacle.row()), x, y) < 0:
            yield f"in obstacles[{j}]"
