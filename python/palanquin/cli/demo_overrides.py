"""What the options of a demo change in its scenario: overrides of fields."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from palanquin.sim.errors import InputError
from palanquin.sim.scenarios import AnyScenario, BarScenario, Scenario, bar_texts, with_robots
from palanquin.sim.scenarios.command import VelocityStep
from palanquin.sim.scenarios.faults import FAULTS
from palanquin.sim.scenarios.recorded import replayed, replayed_on_bars
from palanquin.sim.scenarios.sensors import Sensors

_FOR_BOTH = {"commands", "robots", "velocity", "duration", "seed", "tracking"}


def overridden(scenario: AnyScenario, **options: Any) -> AnyScenario:
    """The scenario with the options that were given, whatever carries; raises as those below."""
    if not isinstance(scenario, BarScenario):
        return hands_overridden(scenario, **options)
    for name in _given(**options).keys() - _FOR_BOTH:
        raise InputError(f"--{name}: robots on bars have no such setting")
    return bars_overridden(scenario, **_given(**options))


def hands_overridden(
    scenario: Scenario,
    *,
    commands: Path | None = None,
    robots: int | None = None,
    gait: str | None = None,
    velocity: str | None = None,
    duration: float | None = None,
    seed: int | None = None,
    tracking: str | None = None,
    state: str | None = None,
    faults: list[str] | None = None,
    **planner: Any,
) -> Scenario:
    """The scenario with the options that were given; `planner` are fields of its settings.

    Raises InputError or ValueError that names the field and the rule.
    """
    if commands is not None:
        scenario = replayed(scenario, commands)
    if robots is not None:
        scenario = with_robots(scenario, robots)
    changes = _given(duration=duration, seed=seed, tracking=tracking, state=state)
    if velocity is not None:
        changes["command"] = {"type": "velocity", "steps": [parse_velocity(velocity)]}
    if gait is not None:
        changes["robots"] = [{**dict(robot), "gait": gait} for robot in scenario.robots]
        changes["gait_changes"] = []
    if faults:
        changes["faults"] = [parse_fault(text) for text in faults]
    # What a scenario leaves open stays open: see `physical`.
    told = {name: getattr(scenario.planner, name) for name in scenario.planner.model_fields_set}
    return scenario.changed(**changes, planner={**told, **_given(**planner)})


def bars_overridden(
    scenario: AnyScenario, *, robots: int | None = None, payload: str | None = None,
    restrict: str | None = None, terrain: str | None = None, velocity: str | None = None,
    noise: float | None = None, delay: float | None = None, friction: float | None = None,
    step: float | None = None, softness: float | None = None, seed: int | None = None,
    commands: Path | None = None, **fields: Any,
) -> BarScenario:  # fmt: skip
    """The scenario of robots on bars with the options that were given; raises as `overridden`."""
    if not isinstance(scenario, BarScenario):
        raise InputError(f"carry: '{scenario.name}' is carried by hands, not on bars")
    if commands is not None:
        scenario = replayed_on_bars(scenario, commands)
    team, ground = _given(robots=robots), _given(friction=friction, step=step, softness=softness)
    if payload is not None:
        team["payload"], team["payload_at"] = bar_texts.parse_payload(payload)
    if restrict is not None:
        team["restrict"] = tuple(axis for axis in restrict.split(",") if axis)
    if terrain is not None:
        told_ground = bar_texts.parse_ground(terrain)
        ground["kind"] = told_ground.kind
        if ":" in terrain:
            ground["height"] = told_ground.height
    if seed is not None:
        ground["seed"] = seed
    sensors = scenario.sensors if noise is None else Sensors.usual(noise, scenario.sensors.delay)
    changes = _given(**fields, seed=seed)
    if velocity is not None:
        told = bar_texts.parse_velocities(velocity)
        changes |= {"velocity": told[0], "velocities": told if len(told) > 1 else ()}
    return scenario.changed(
        team=replace(scenario.team, **team),
        ground=replace(scenario.ground, **ground),
        sensors=replace(sensors, **_given(delay=delay)),
        **changes,
    )


def _given(**options: Any) -> dict[str, Any]:
    """Those that were given, choices by their names."""
    return {
        name: str(value) if isinstance(value, StrEnum) else value
        for name, value in options.items()
        if value is not None
    }


def parse_fault(text: str) -> dict[str, Any]:
    """A fault of the form KIND[@TIME]; raises ValueError that shows it."""
    kind, at, time = text.partition("@")
    try:
        return {"type": kind, **({"start": float(time)} if at else {})}
    except ValueError as error:
        raise ValueError(
            f"--fault {text}: KIND[@TIME] is needed, such as motor-dead@3.5; KIND is one of "
            f"{', '.join(FAULTS)}"
        ) from error


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
