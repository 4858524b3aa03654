"""Where a scenario's command takes the payload and the feet, as far as that is known beforehand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palanquin.problems.clm.references import payload_path
from palanquin.sim.scenarios.scenario import Scenario

_STEP = 0.1
"""Between two looks at the way, s."""

_LONGEST = 300.0
"""How far ahead anybody looks, s."""


def payload_route(scenario: Scenario) -> NDArray[np.float64]:
    """Poses (x, y, yaw) of the payload's reference for five minutes at most, [n, 3], m and rad."""
    command, ground = scenario.command.start(), scenario.ground.trend
    pose = scenario.start_pose.draw(scenario.seed)
    poses = [pose]
    for time in np.arange(0.0, min(scenario.duration, _LONGEST), _STEP):
        velocity = command.velocity(float(time), pose, _STEP)
        pose = payload_path(ground, pose, velocity, 1, _STEP).pose[1]
        poses.append(pose)
    return np.array(poses)


def foothold_route(scenario: Scenario) -> NDArray[np.float64]:
    """Points (x, y) under the hips all the way, [n, 2], m."""
    team = scenario.team
    in_payload = []
    for carrier in team.carriers:
        cos, sin = np.cos(carrier.yaw), np.sin(carrier.yaw)
        hips = np.subtract(carrier.model.hips, carrier.model.hand)[:, :2]
        in_payload.append(carrier.attach[:2] + hips @ np.array([[cos, sin], [-sin, cos]]))
    points = np.concatenate(in_payload)
    x, y, yaw = payload_route(scenario).T[:, :, None]
    cos, sin = np.cos(yaw), np.sin(yaw)
    along = x + cos * points[:, 0] - sin * points[:, 1]
    across = y + sin * points[:, 0] + cos * points[:, 1]
    return np.stack([along.ravel(), across.ravel()], axis=-1)
