"""Where a scenario's command takes the payload and the feet, as far as that is known beforehand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palanquin.problems.clm.references import payload_path
from palanquin.sim.scenarios.scenario import Scenario

_STEP = 0.1
"""Between two looks at the way, s; more for a way that needs more than so many looks."""

_MOST = 6000


def look_times(scenario: Scenario) -> NDArray[np.float64]:
    """When anybody looks at the way, [n], s: from 0 to the end."""
    step = max(_STEP, scenario.duration / _MOST)
    return step * np.arange(np.ceil(scenario.duration / step - 1e-9) + 1, dtype=np.float64)


def payload_route(scenario: Scenario) -> NDArray[np.float64]:
    """The payload's reference (x, y, yaw) at the times of `look_times`, [n, 3], m and rad."""
    command, ground = scenario.command.start(), scenario.ground.trend
    pose = scenario.start_pose.draw(scenario.seed)
    times = look_times(scenario)
    step = float(times[1])
    poses = [pose]
    for time in times[:-1]:
        velocity = command.velocity(float(time), pose, step)
        pose = payload_path(ground, pose, velocity, 1, step)[1]
        poses.append(pose)
    return np.array(poses)


def hip_routes(scenario: Scenario) -> NDArray[np.float64]:
    """Points (x, y) under each robot's hips at the times of `look_times`, [n, R, 4, 2], m."""
    in_payload = []
    for carrier in scenario.team.carriers:
        cos, sin = np.cos(carrier.yaw), np.sin(carrier.yaw)
        hips = np.subtract(carrier.model.hips, carrier.model.hand)[:, :2]
        in_payload.append(carrier.attach[:2] + hips @ np.array([[cos, sin], [-sin, cos]]))
    points = np.array(in_payload)
    x, y, yaw = payload_route(scenario).T[..., None, None]
    cos, sin = np.cos(yaw), np.sin(yaw)
    along = x + cos * points[..., 0] - sin * points[..., 1]
    across = y + sin * points[..., 0] + cos * points[..., 1]
    return np.stack([along, across], axis=-1)


def foothold_route(scenario: Scenario) -> NDArray[np.float64]:
    """Points (x, y) under the hips all the way, [n, 2], m."""
    return hip_routes(scenario).reshape(-1, 2)
