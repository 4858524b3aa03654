"""Can a run of bar carriers be as it is told? What cannot is explained in words."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from palanquin.problems.planning import Velocity
from palanquin.sim.feasibility.finding import Finding
from palanquin.sim.scenarios.bar_ground import BEHIND, LENGTH, WIDTH
from palanquin.sim.scenarios.bars import STANDING_TIME, BarScenario, start_pose
from palanquin.sim.scenes.bar_scene import places

_STEP = 0.05
"""Between two looks at the way, s."""

_HALF_LENGTH, _HALF_WIDTH = 0.2, 0.15
"""From an A1's centre to its feet, m."""

_EXTENT = (-BEHIND, LENGTH - BEHIND), (-WIDTH / 2, WIDTH / 2)
"""Of the ground along x and y, m."""


def findings(scenario: BarScenario) -> list[Finding]:
    """What is impossible about a run that is told its scenario's commands."""
    return [*ground_to_walk_on(scenario), *gaits_to_walk_with(scenario)]


def ground_to_walk_on(scenario: BarScenario) -> Iterator[Finding]:
    """No robot is told to leave the ground that there is: a height field and a raised half end, a
    plane does not.
    """
    routes = commanded_routes(scenario)
    for robot, route in enumerate(routes):
        (west, east), (south, north) = _ground_of(scenario, robot)
        x, y = route.T
        off = (x - _HALF_LENGTH < west) | (x + _HALF_LENGTH > east)
        off |= (y - _HALF_WIDTH < south) | (y + _HALF_WIDTH > north)
        if off.any():
            at = int(off.argmax())
            yield Finding(
                ("velocity",),
                f"{scenario.team.names[robot]} is told to walk off its ground after "
                f"{_STEP * at:.1f} s, at ({x[at]:.2f}, {y[at]:.2f}) m: the ground is from "
                f"{west:g} to {east:g} m along x and from {south:g} to {north:g} m along y",
            )


def gaits_to_walk_with(scenario: BarScenario) -> Iterator[Finding]:
    """Who is told a velocity has a gait whose feet move."""
    settled = STANDING_TIME + scenario.ramp
    changes = [change.time for change in scenario.velocity_changes]
    changes += [change.time for change in scenario.gait_changes]
    times = sorted({settled, *(max(time, settled) for time in changes)})
    for robot, name in enumerate(scenario.names):
        for time in (time for time in times if time < scenario.duration):
            gait = scenario.gait_of(robot, time)
            if scenario.command(robot, time) != Velocity() and min(gait.duty) >= 1:
                yield Finding(
                    ("velocity",),
                    f"{name} is told to walk at {time:g} s with the gait '{gait.name}', whose feet "
                    "never move",
                )


def commanded_routes(scenario: BarScenario) -> NDArray[np.float64]:
    """Centres (x, y) of the robots [M, n, 2] every 0.05 s until the run ends, m, as commanded."""
    x0, y0, yaw0 = start_pose(scenario.seed)
    turn = np.array([[math.cos(yaw0), math.sin(yaw0)], [-math.sin(yaw0), math.cos(yaw0)]])
    position = places(scenario.team, scenario.ground)[:, :2] @ turn + (x0, y0)
    robots = range(scenario.team.robots)
    yaws = np.full(len(robots), yaw0)
    start, routes = position.copy(), [position.copy()]
    for time in np.arange(0.0, scenario.duration, _STEP):
        commands = [scenario.command(robot, float(time)) for robot in robots]
        vx, vy, wz = np.array([(c.vx, c.vy, c.wz) for c in commands]).T
        cos, sin = np.cos(yaws), np.sin(yaws)
        position += _STEP * np.column_stack([cos * vx - sin * vy, sin * vx + cos * vy])
        yaws += _STEP * wz
        routes.append(position.copy())
        if (position - start)[:, 0].min() >= (scenario.distance or math.inf):
            break
    return np.stack(routes, axis=1)


def _ground_of(
    scenario: BarScenario, robot: int
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Where along x and y a robot may walk, m."""
    along, (south, north) = _EXTENT
    on_step = scenario.ground.step > 0 and scenario.team.lanes[robot] > 0
    if on_step:
        return along, (0.0, north)
    if scenario.ground.kind == "rough":
        return along, (south, north)
    return (-math.inf, math.inf), (-math.inf, math.inf)
