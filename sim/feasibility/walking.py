"""Can the gaits carry the robots as fast as they are told?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from palanquin.problems.gaits import Gait
from palanquin.schema import Path
from palanquin.sim.feasibility.finding import Finding, doubt
from palanquin.sim.feasibility.ground import longest_step
from palanquin.sim.scenarios.robot import Robot
from palanquin.sim.scenarios.route import hip_routes, look_times
from palanquin.sim.scenarios.scenario import Scenario

_LONGEST_FLIGHT = 0.3
"""With all feet in the air, s: for it a robot has to jump 11 cm high."""

_SHORTEST_STANCE = 0.1
"""Share of a cycle in which at least one foot has to stand."""


def flights_to_survive(scenario: Scenario) -> Iterator[Finding]:
    """Every gait has feet on the ground for some time, and all in the air not for long."""
    for path, gait in gaits_of(scenario):
        seconds = longest_flight(gait)
        if seconds > (1 - _SHORTEST_STANCE) * gait.period:
            yield Finding(
                path,
                f"gait '{gait.name}' has next to no stance: all feet are in the air for "
                f"{seconds:.2f} of {gait.period:.2f} s, so legs would have to push with more than "
                f"{1 / _SHORTEST_STANCE:.0f} times the weight",
            )
            continue
        if seconds > _LONGEST_FLIGHT:
            yield doubt(
                path,
                f"gait '{gait.name}' has all feet in the air for {seconds:.2f} s at a time: a "
                f"jump {100 * 9.81 * seconds**2 / 8:.0f} cm high",
            )


def speeds_to_walk(scenario: Scenario) -> Iterator[Finding]:
    """While a foot stands, its hip moves on by no more than the longest step."""
    times, hips = look_times(scenario), hip_routes(scenario)
    speeds = np.linalg.norm(np.diff(hips, axis=0), axis=-1).max(axis=-1) / times[1]
    for robot, speed in zip(scenario.robots, speeds.T, strict=True):
        step = longest_step(scenario, robot)
        for gait, when in _gaits_over(scenario, robot, times[:-1]):
            if max(gait.duty) == 1 or not when.any():
                continue
            fastest = float(speed[when].max())
            stride = fastest * max(gait.duty) * gait.period
            if stride > step:
                yield doubt(
                    ("command",),
                    f"at {fastest:.3g} m/s {robot.name} moves {stride:.2f} m while a foot stands "
                    f"('{gait.name}'); its legs reach {step:.2f} m",
                )
                break


def _gaits_over(
    scenario: Scenario, robot: Robot, times: NDArray[np.float64]
) -> Iterator[tuple[Gait, NDArray[np.bool_]]]:
    """The gaits of a robot one after the other, and at which of `times` [n] it has them."""
    begins = sorted({0.0, *(change.time for change in scenario.gait_changes)})
    for begin, end in zip(begins, [*begins[1:], np.inf], strict=True):
        yield scenario.gait_of(robot, begin), (times >= begin) & (times < end)


def gaits_of(scenario: Scenario) -> Iterator[tuple[Path, Gait]]:
    """All gaits of a scenario and where they stand in it."""
    for i, robot in enumerate(scenario.robots):
        yield ("robots", i, "gait"), robot.gait.gait
    for i, change in enumerate(scenario.gait_changes):
        yield ("gait_changes", i, "gait"), change.gait.gait


def longest_flight(gait: Gait) -> float:
    """Longest time without any foot on the ground, s, to a hundredth of a cycle."""
    samples = 100
    stands = np.any(gait.stands(np.arange(2 * samples) / samples), axis=-1)
    longest = current = 0
    for is_standing in stands.tolist():
        current = 0 if is_standing else current + 1
        longest = max(longest, current)
    return min(longest, samples) / samples * gait.period
