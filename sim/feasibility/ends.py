"""Does the way stay on the ground that there is?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from palanquin.problems.foothold_areas import FootholdAreas
from palanquin.problems.height_map import HeightMap
from palanquin.problems.robots import FEET
from palanquin.sim.feasibility.finding import Finding, doubt
from palanquin.sim.feasibility.ground import longest_step
from palanquin.sim.scenarios.route import hip_routes, look_times
from palanquin.sim.scenarios.scenario import Scenario


def ground_to_walk_on(scenario: Scenario) -> Iterator[Finding]:
    """Below every hip there is ground within the leg's reach, all the way."""
    ground = scenario.ground
    if isinstance(ground, FootholdAreas):
        yield from _areas_in_reach(scenario, ground)
    elif isinstance(ground, HeightMap):
        yield from _within_the_map(scenario, ground)


def _areas_in_reach(scenario: Scenario, ground: FootholdAreas) -> Iterator[Finding]:
    hips = hip_routes(scenario)
    points = np.concatenate([hips, np.zeros_like(hips[..., :1])], axis=-1)
    gaps = np.linalg.norm(ground.nearest(points)[..., :2] - hips, axis=-1)
    reach = np.array([longest_step(scenario, robot) / 2 for robot in scenario.robots])
    missed = gaps > reach[:, None]
    if not missed.any():
        return
    k, r, f = np.argwhere(missed)[0]
    x, y = hips[k, r, f]
    yield Finding(
        ("terrain",),
        f"after {look_times(scenario)[k]:.1f} s the way leads off the ground: {FEET[f]} of "
        f"{scenario.robots[r].name} would stand near ({x:.2f}, {y:.2f}) m, {gaps[k, r, f]:.2f} m "
        f"from the nearest place where feet may stand; the leg reaches {reach[r]:.2f} m",
    )


def _within_the_map(scenario: Scenario, ground: HeightMap) -> Iterator[Finding]:
    hips = hip_routes(scenario)
    low = np.array(ground.origin)
    high = low + ground.spacing * (np.array(ground.heights.shape[::-1]) - 1)
    off = ((hips < low) | (hips > high)).any(axis=-1)
    if off.any():
        k, r, f = np.argwhere(off)[0]
        x, y = hips[k, r, f]
        yield doubt(
            ("terrain",),
            f"after {look_times(scenario)[k]:.1f} s {FEET[f]} of {scenario.robots[r].name} is off "
            f"the height map, at ({x:.2f}, {y:.2f}) m; beyond its edges the ground goes on as it "
            "ends there",
        )
