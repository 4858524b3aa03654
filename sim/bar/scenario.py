"""A run of bar carriers as data: team, ground, forces, commands, planner, sensors."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palanquin import _sim
from palanquin.problems.clm.references import Velocity
from palanquin.sim.bar.disturbances import Force, Rope
from palanquin.sim.bar.ground import Ground
from palanquin.sim.bar.limits import TIMESTEP, require_number, require_seed, timesteps
from palanquin.sim.bar.team import BarTeam
from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.script import Orders

PLANNERS = ("centralized", "distributed", "nominal")

STANDING_TIME = 0.5
"""Before the first step, s."""

RAMP_TIME = 1.0
"""In which the command grows to its full value after that, s."""

LONGEST = 600.0
"""Run, s."""


@dataclass(frozen=True)
class Sensors:
    """What the controllers and planners know: the state with white noise, some periods late.

    Standard deviations in m, rad, m/s, rad/s; `delay` in s. All zero by default.
    """

    position: float = 0.0
    orientation: float = 0.0
    velocity: float = 0.0
    rate: float = 0.0
    joint_position: float = 0.0
    joint_velocity: float = 0.0
    delay: float = 0.0

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
class BarScenario:
    """Everything that decides a run.

    Attributes:
        team: robots, bars and load.
        ground: what they walk on.
        planner: one of `PLANNERS`.
        velocity: command to all robots, each in its own heading.
        velocities: commands of single robots instead, one each; empty for the same to all.
        forces: from outside.
        sensors: noise and delay.
        friction: coefficient that planner and controllers count on; the ground's, at most 0.6,
            unless given.
        duration: s.
        distance: the run also ends when every robot has gone so far along x, m.
        seed: of noise, and of a small random turn and shift of the start unless 0.
    """

    team: BarTeam = field(default_factory=BarTeam)
    ground: Ground = field(default_factory=Ground)
    planner: str = "centralized"
    velocity: Velocity = field(default_factory=lambda: Velocity(0.5))
    velocities: tuple[Velocity, ...] = ()
    forces: tuple[Force | Rope, ...] = ()
    sensors: Sensors = field(default_factory=Sensors)
    friction: float | None = None
    duration: float = 10.0
    distance: float = math.inf
    seed: int = 0

    def __post_init__(self) -> None:
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
        require_number("distance", self.distance, 1e-3, math.inf, "m")
        if self.friction is not None:
            require_number("friction", self.friction, 0.01, 10.0)
        require_seed("seed", self.seed)
        self.sensors.settings(self.seed)

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


def start_pose(seed: int) -> NDArray[np.float64]:
    """(x, y, yaw) [3] by which a run's whole team begins off its nominal place: up to 5 cm and
    0.1 rad, as the seed draws; 0 for seed 0.
    """
    if seed == 0:
        return np.zeros(3)
    random = np.random.default_rng(seed)
    yaw = random.uniform(-0.1, 0.1)
    return np.append(random.uniform(-0.05, 0.05, 2), yaw)
