"""Can the gaits carry the robots as fast as they are told?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from palanquin.problems.gaits import Gait
from palanquin.schema import Path
from palanquin.sim.closed_loop import number_of_ticks
from palanquin.sim.errors import InputError
from palanquin.sim.feasibility.finding import Finding, doubt
from palanquin.sim.feasibility.ground import longest_step
from palanquin.sim.scenarios.command import VelocityCommand
from palanquin.sim.scenarios.scenario import Scenario

_LONGEST_FLIGHT = 0.3
"""With all feet in the air, s: for it a robot has to jump 11 cm high."""

_SHORTEST_STANCE = 0.1
"""Share of a cycle in which at least one foot has to stand."""


def ticks_to_plan(scenario: Scenario) -> Iterator[Finding]:
    """The duration has at least one period, and no more than a run can hold."""
    try:
        number_of_ticks(scenario.duration, scenario.planner.period)
    except InputError as error:
        yield Finding(("duration",), str(error).removeprefix("duration: "))


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
    """While a foot stands, the hip moves on by no more than the longest step."""
    command = scenario.command
    speeds = (
        [np.hypot(step.vx, step.vy) for step in command.steps]
        if isinstance(command, VelocityCommand)
        else [way.speed or command.speed for way in command.through]
    )
    fastest = float(max(speeds))
    for robot in scenario.robots:
        gait = robot.gait.gait
        stride, step = fastest * max(gait.duty) * gait.period, longest_step(scenario, robot)
        if stride > step and max(gait.duty) < 1:
            yield doubt(
                ("command",),
                f"at {fastest:g} m/s {robot.name} moves {stride:.2f} m while a foot "
                f"stands ('{gait.name}'); its legs reach {step:.2f} m",
            )


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
