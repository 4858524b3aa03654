"""A run of bar carriers as data: team, ground, forces, commands, planner, sensors."""

from __future__ import annotations

import math
import re
from dataclasses import asdict, dataclass, field, fields, replace
from itertools import chain
from numbers import Real
from typing import Annotated, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from palanquin import _sim
from palanquin.problems.clm.references import Velocity
from palanquin.schema import Path, StrictData, unknown_keys
from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.bar_forces import Force, Rope
from palanquin.sim.scenarios.bar_ground import Ground
from palanquin.sim.scenarios.bar_team import BarTeam
from palanquin.sim.scenarios.bar_texts import parse_force
from palanquin.sim.scenarios.limits import TIMESTEP, require_number, require_seed, timesteps
from palanquin.sim.scenarios.script import Orders
from palanquin.sim.scenarios.vectors import Name

Planning = Literal["centralized", "distributed", "nominal"]
PLANNERS = get_args(Planning)

STANDING_TIME = 0.5
"""Before the first step, s."""

RAMP_TIME = 1.0
"""In which the command grows to its full value after that, s."""

LONGEST = 600.0
"""Run, s."""


@dataclass(frozen=True)
class Sensors(StrictData):
    """What the controllers and planners know: the state with white noise, some periods late.

    Standard deviations in m, rad, m/s, rad/s; `delay` in s. All zero by default.
    """

    position: Annotated[float, Field(description="standard deviation, m")] = 0.0
    orientation: Annotated[float, Field(description="standard deviation, rad")] = 0.0
    velocity: Annotated[float, Field(description="standard deviation, m/s")] = 0.0
    rate: Annotated[float, Field(description="standard deviation, rad/s")] = 0.0
    joint_position: Annotated[float, Field(description="standard deviation, rad")] = 0.0
    joint_velocity: Annotated[float, Field(description="standard deviation, rad/s")] = 0.0
    delay: Annotated[float, Field(description="of the measured state, s")] = 0.0

    @classmethod
    def usual(cls, multiple: float = 1.0, delay: float = 0.0) -> Sensors:
        """Noise of joint encoders, an IMU and a leg-odometry estimate, times `multiple`."""
        require_number("noise", multiple, 0.0, 1000.0)
        noise = {
            "position": 2e-3,
            "orientation": 3e-3,
            "velocity": 2e-2,
            "rate": 2e-2,
            "joint_position": 1e-3,
            "joint_velocity": 5e-2,
        }
        return cls(**{name: multiple * value for name, value in noise.items()}, delay=delay)

    def settings(self, seed: int) -> _sim.MeasurementSettings:
        """For the stepper; raises InputError for bad values, or a delay between two steps."""
        settings = _sim.MeasurementSettings()
        for name in (f.name for f in fields(self) if f.name != "delay"):
            setattr(settings, name, _number(f"sensors.{name}", getattr(self, name)))
        require_number("sensors.delay", self.delay, 0.0, LONGEST, "s")
        settings.delay = timesteps("sensors.delay", self.delay)
        settings.seed = seed
        if problem := settings.explain_invalid():
            raise InputError(f"sensors: {problem}")
        return settings


def _number(field: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, Real):
        raise InputError(f"{field}: {value!r} must be a number")
    return float(value)


@dataclass(frozen=True)
class BarScenario(StrictData):
    """Robots in a row walk with bars between them, in full physics. The same fields stand in
    scenario files, with `carry: bars`. Use `changed` for a variant.
    """

    team: Annotated[BarTeam, Field(description="robots, bars and load")] = field(
        default_factory=BarTeam
    )
    ground: Annotated[Ground, Field(description="what they walk on, blindly")] = field(
        default_factory=Ground
    )
    planner: Annotated[Planning, Field(description="one QP for all, one a robot, or no bars")] = (
        "centralized"
    )
    velocity: Annotated[Velocity, Field(description="of all robots, each in its own heading")] = (
        field(default_factory=lambda: Velocity(0.5))
    )
    velocities: Annotated[
        tuple[Velocity, ...], Field(description="of single robots instead, one each")
    ] = ()
    forces: Annotated[
        tuple[str | Force | Rope, ...],
        Field(description="from outside; texts such as sin:20 or push:0,80,0@3,3.2:1 will do"),
    ] = ()
    sensors: Annotated[Sensors, Field(description="noise and delay")] = field(
        default_factory=Sensors
    )
    friction: Annotated[
        float | None,
        Field(description="that planner and controllers count on: the ground's, at most 0.6"),
    ] = None
    duration: Annotated[float, Field(description="of the run, s")] = 10.0
    distance: Annotated[
        float | None, Field(description="the run also ends when all have gone so far along x, m")
    ] = None
    seed: Annotated[
        int, Field(description="of noise, and from 1 on of a small turn and shift of the start")
    ] = 0
    name: Annotated[Name, Field(description="of its files and figures")] = "bar"
    summary: Annotated[str, Field(description="what one should see, in a sentence")] = ""
    carry: Annotated[Literal["bars"], Field(description="bars on joints, not hands")] = "bars"

    def __post_init__(self) -> None:
        forces = [parsed(force, self.team.robots) for force in self.forces]
        object.__setattr__(self, "forces", tuple(chain.from_iterable(forces)))
        if self.planner not in PLANNERS:
            raise InputError(f"planner: {self.planner!r} is not one of {', '.join(PLANNERS)}")
        if self.velocities and len(self.velocities) != self.team.robots:
            raise InputError(
                f"velocities: {len(self.velocities)} for {self.team.robots} robots; one each"
            )
        for command in self.commands:
            if math.hypot(command.vx, command.vy) > 1.5 or abs(command.wz) > 1.5:
                raise InputError(f"velocity: {command} is over 1.5 m/s or 1.5 rad/s")
        require_number("duration", self.duration, TIMESTEP, LONGEST, "s")
        if self.distance is not None:
            require_number("distance", self.distance, 1e-3, math.inf, "m")
        if self.friction is not None:
            require_number("friction", self.friction, 0.01, 10.0)
        require_seed("seed", self.seed)
        self.sensors.settings(self.seed)

    def changed(self, **fields: Any) -> BarScenario:
        """A copy with other values; raises InputError that names the field and the rule."""
        return replace(self, **fields)

    def as_data(self) -> dict[str, Any]:
        """Its fields, for JSON."""
        return _json_of(asdict(self))

    @property
    def disturbances(self) -> tuple[Force | Rope, ...]:
        """The forces, none of them a text any more."""
        return tuple(force for force in self.forces if not isinstance(force, str))

    @property
    def names(self) -> tuple[str, ...]:
        """Of the robots, from left to right."""
        return self.team.names

    @property
    def trackings(self) -> tuple[str, ...]:
        """How its plan can be followed."""
        return ("physics",)

    def check_tracking(self, tracking: str) -> None:
        """Raises InputError unless the plan can be followed that way."""
        if tracking not in self.trackings:
            raise InputError(
                f"tracking: '{tracking}' is not available for robots on bars; there is physics"
            )

    def described(self) -> str:
        """Who walks where with what."""
        team, ground = self.team, self.ground
        load = f"with {team.payload:g} kg on each bar" if team.payload else "without a load"
        where = ground.kind if ground.kind == "flat" else f"{ground.kind} ({ground.height:g} m)"
        return f"{team.robots} A1s on bars walk on {where} ground {load}, planned {self.planner}."

    @property
    def commands(self) -> tuple[Velocity, ...]:
        """Full commands of the robots, [M]."""
        return self.velocities or (self.velocity,) * self.team.robots

    @property
    def assumed_friction(self) -> float:
        """What planner and controllers count on: 0.6 as in V-A.3, less where it is slippery."""
        return min(0.6, self.ground.friction) if self.friction is None else self.friction

    def at(self, time: float, pose: NDArray[np.float64], period: float) -> Orders:
        """As of `Director`: the robots' commands."""
        return Orders(tuple(self.command(i, time) for i in range(self.team.robots)))

    def command(self, robot: int, time: float) -> Velocity:
        """Of `robot` at `time` (s): nothing while it stands, then growing to the full command."""
        full = self.commands[robot]
        share = min(1.0, max(0.0, (time - STANDING_TIME) / RAMP_TIME))
        if share == 1.0:
            return full
        return Velocity(share * full.vx, share * full.vy, share * full.wz)


def parsed(force: str | Force | Rope, robots: int) -> tuple[Force | Rope, ...]:
    """A force, or those that a text describes; raises InputError for a robot that is not there."""
    found = parse_force(force, robots) if isinstance(force, str) else (force,)
    for one in found:
        if not 0 <= one.robot < robots:
            raise InputError(f"forces: robot {one.robot} is none of 0 to {robots - 1}")
    return found


def _json_of(value: Any) -> Any:
    """With null for numbers that JSON has none of: a force's infinite period."""
    if isinstance(value, dict):
        return {key: _json_of(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_json_of(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


_PARTS = {"team": BarTeam, "ground": Ground, "sensors": Sensors, "velocity": Velocity}


def bar_fault(where: Path, message: str) -> tuple[Path, str]:
    """A fault of a file as `schema.faults` tells it, at the field that its message names."""
    if message.endswith("unexpected keyword argument"):
        part = _PARTS.get(str(where[0]), BarScenario) if len(where) > 1 else BarScenario
        return where[:-1], unknown_keys(where[-1:], [field.name for field in fields(part)])
    name, colon, rest = message.partition(": ")
    if not colon or not re.fullmatch(r"[a-z_.]+", name):
        return where, message
    steps = ("forces",) if name == "force" else tuple(name.split("."))
    inner = steps[len(where) :] if steps[: len(where)] == where else steps
    return (*where, *inner), rest


def start_pose(seed: int) -> NDArray[np.float64]:
    """(x, y, yaw) [3] by which a run's whole team begins off its nominal place: up to 5 cm and
    0.1 rad, as the seed draws; 0 for seed 0.
    """
    if seed == 0:
        return np.zeros(3)
    random = np.random.default_rng(seed)
    yaw = random.uniform(-0.1, 0.1)
    return np.append(random.uniform(-0.05, 0.05, 2), yaw)
