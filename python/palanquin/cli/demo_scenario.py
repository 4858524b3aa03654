"""What the options of a demo change in its scenario, and what its figures say of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from palanquin.cli.demo_files import PICTURE_SHARE
from palanquin.problems.clm.planner import Planner
from palanquin.sim.runs.record import Record
from palanquin.sim.scenarios import Scenario, with_robots
from palanquin.sim.scenarios.command import VelocityStep
from palanquin.sim.scenarios.recorded import replayed


def overridden(
    scenario: Scenario,
    *,
    commands: Path | None = None,
    robots: int | None = None,
    gait: str | None = None,
    velocity: str | None = None,
    duration: float | None = None,
    seed: int | None = None,
    **planner: Any,
) -> Scenario:
    """The scenario with the options that were given; `planner` are fields of its settings.

    Raises InputError or ValueError that names the field and the rule.
    """
    if commands is not None:
        scenario = replayed(scenario, commands)
    if robots is not None:
        scenario = with_robots(scenario, robots)
    changes: dict[str, Any] = {
        name: value for name, value in (("duration", duration), ("seed", seed)) if value is not None
    }
    if velocity is not None:
        changes["command"] = {"type": "velocity", "steps": [parse_velocity(velocity)]}
    if gait is not None:
        changes["robots"] = [{**dict(robot), "gait": gait} for robot in scenario.robots]
        changes["gait_changes"] = []
    given = {name: value for name, value in planner.items() if value is not None}
    return scenario.changed(**changes, planner={**dict(scenario.planner), **given})


def parse_velocity(text: str) -> VelocityStep:
    """A command of the form VX[,VY[,WZ]]; raises ValueError that shows it."""
    names = ("vx", "vy", "wz")
    try:
        values = [float(part) for part in text.split(",")]
        return VelocityStep(**dict(zip(names[: len(values)], values, strict=True)))
    except ValueError as error:
        raise ValueError(
            f"--velocity {text}: VX[,VY[,WZ]] is needed, such as 0.4 or 0.3,0,0.2"
        ) from error


def picture_share(rollout: Record) -> float:
    """When in a run its picture is taken: in the middle of what pushes, or else under way."""
    pushed = np.flatnonzero(rollout.more["disturbance"].any(axis=(1, 2)))
    if not len(pushed) or rollout.time[-1] == 0:
        return PICTURE_SHARE
    return float(rollout.time[pushed[len(pushed) // 2]] / rollout.time[-1])


def settings_of(scenario: Scenario, planner: Planner) -> dict[str, Any]:
    """The settings that a run was made with, for its figures."""
    gaits = [robot.gait.name for robot in scenario.robots]
    first = scenario.command.start().velocity(0.0, planner.reference, scenario.planner.period)
    settings = planner.sqp.settings
    return {
        "gait": gaits[0] if len(set(gaits)) == 1 else gaits,
        "gait_changes": len(scenario.gait_changes),
        "velocity": [first.vx, first.vy, first.wz],
        "command": scenario.command.model_dump(mode="json"),
        "horizon": planner.horizon,
        "dt_s": planner.dt,
        "rate_hz": scenario.planner.rate,
        "qp": settings.qp,
        "sqp_iterations_per_period": settings.max_iterations,
        "threads": settings.threads,
        "candidates": scenario.planner.candidates,
    }
