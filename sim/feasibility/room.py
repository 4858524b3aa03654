"""Do hands and trunks have room beside each other?"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from palanquin.problems.robots import quadruped
from palanquin.sim.feasibility.finding import Finding, doubt
from palanquin.sim.scenarios.robot import Robot
from palanquin.sim.scenarios.scenario import Scenario

HAND_WIDTH = 0.1
"""Of the grip along the payload, m."""

_HANDLE = 0.15
"""Longest handle by which a grasp may stick out of the payload without a question, m."""


def grasps_apart(scenario: Scenario) -> Iterator[Finding]:
    """Two grasp points are at least a hand's width apart."""
    for (_, one), (j, other) in combinations(enumerate(scenario.robots), 2):
        distance = np.linalg.norm(np.subtract(one.attach, other.attach))
        if distance < HAND_WIDTH:
            yield Finding(
                ("robots", j, "attach"),
                f"grasp points {list(other.attach)} of {other.name} and {list(one.attach)} of "
                f"{one.name} overlap: {100 * distance:.1f} cm apart, where a hand takes "
                f"{100 * HAND_WIDTH:.0f} cm",
            )


def grasps_on_the_payload(scenario: Scenario) -> Iterator[Finding]:
    """A grasp point is on the payload or on a short handle."""
    half = np.asarray(scenario.payload.shape.extents) / 2
    for i, robot in enumerate(scenario.robots):
        outside = np.linalg.norm(np.maximum(np.abs(robot.attach) - half, 0.0))
        if outside > _HANDLE:
            yield doubt(
                ("robots", i, "attach"),
                f"the grasp of {robot.name} is {100 * outside:.0f} cm outside the payload",
            )


def trunks_apart(scenario: Scenario) -> Iterator[Finding]:
    """Seen from above, no trunk stands in another one in the nominal pose."""
    for (_, one), (j, other) in combinations(enumerate(scenario.robots), 2):
        if _overlap(_footprint(one), _footprint(other)):
            yield Finding(
                ("robots", j, "attach"),
                f"{other.name} would stand in {one.name}: their grasps are too near for two robots "
                "with these headings",
            )


def _footprint(robot: Robot) -> NDArray[np.float64]:
    """Corners of trunk and hips in the payload's frame, counter-clockwise, [4, 2], m."""
    hips = np.array(robot.body.hips)[:, :2]
    half = np.asarray(quadruped(robot.model).trunk_size[:2]) / 2
    centre = hips.mean(axis=0)
    half = np.maximum(half, np.abs(hips - centre).max(axis=0))
    corners = centre + half * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    cos, sin = np.cos(robot.yaw), np.sin(robot.yaw)
    to_payload = np.array([[cos, -sin], [sin, cos]])
    return np.asarray(robot.attach[:2] + (corners - robot.body.hand[:2]) @ to_payload.T)


def _overlap(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Whether two rectangles overlap: no side of either separates them."""
    for corners in (one, other):
        for side in (corners[1] - corners[0], corners[2] - corners[1]):
            first, second = one @ side, other @ side
            if first.max() <= second.min() or second.max() <= first.min():
                return False
    return True
