"""A run of bar carriers as data: team, ground, forces, commands, planner, sensors."""

from __future__ import annotations

import math
import re
from dataclasses import asdict, dataclass, field, fields, replace
from itertools import chain
from typing import Annotated, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from palanquin.problems.gaits import Gait
from palanquin.problems.layered.planner import Planner
from palanquin.problems.layered.settings import WORKING, LayeredSettings
from palanquin.problems.planning import Velocity
from palanquin.schema import Path, Strict, StrictData, unknown_keys
from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.bar_forces import Force, Rope
from palanquin.sim.scenarios.bar_ground import Ground
from palanquin.sim.scenarios.bar_planners import PHYSICS, build_planner
from palanquin.sim.scenarios.bar_team import BarTeam
from palanquin.sim.scenarios.bar_texts import parse_force
from palanquin.sim.scenarios.command import VelocityChange
from palanquin.sim.scenarios.gait import GaitChange, GaitChoice
from palanquin.sim.scenarios.limits import TIMESTEP, require_number, require_seed
from palanquin.sim.scenarios.script import Orders
from palanquin.sim.scenarios.sensors import LONGEST, Sensors
from palanquin.sim.scenarios.vectors import Name

Planning = Literal["centralized", "distributed", "nominal"]
Tracking = Literal["physics", "reduced"]
PLANNERS, TRACKINGS = get_args(Planning), get_args(Tracking)

SETTINGS = {"physics": PHYSICS, "reduced": WORKING}
"""Of the planner, by how its plan is followed."""

STANDING_TIME = 0.5
"""Before the robots are told to walk, s."""

GAIT = GaitChoice(name="trot", period=0.4)
"""With which they start."""


@dataclass(frozen=True)
class BarScenario(StrictData):
    """Robots in a row walk with bars between them. The same fields stand in scenario files, with
    `carry: bars`. Use `changed` for a variant.
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
    ramp: Annotated[float, Field(description="in which velocities grow to their full value, s")] = (
        1.0
    )
    velocity_changes: Annotated[
        tuple[VelocityChange, ...], Field(description="on the way, at once and in order")
    ] = ()
    gait: Annotated[GaitChoice, Field(description="of all robots from the start")] = GAIT
    gait_changes: Annotated[tuple[GaitChange, ...], Field(description="on the way")] = ()
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
    tracking: Annotated[
        Tracking,
        Field(description="physics and controllers, or reduced: rigid bodies on level ground"),
    ] = "physics"
    name: Annotated[Name, Field(description="of its files and figures")] = "bar"
    summary: Annotated[str, Field(description="what one should see, in a sentence")] = ""
    carry: Annotated[Literal["bars"], Field(description="bars on joints, not hands")] = "bars"

    def __post_init__(self) -> None:
        forces = [parsed(force, self.team.robots) for force in self.forces]
        object.__setattr__(self, "forces", tuple(chain.from_iterable(forces)))
        for name, known in (("planner", PLANNERS), ("tracking", TRACKINGS)):
            if getattr(self, name) not in known:
                shown = f"{getattr(self, name)!r} is not one of {', '.join(known)}"
                raise InputError(f"{name}: {shown}")
        for name in ("gait_changes", "velocity_changes"):
            for change in getattr(self, name):
                if unknown := set(change.robots) - set(self.names):
                    names = ", ".join(self.names)
                    raise InputError(f"{name}: {min(unknown)!r} is not one of {names}")
        times = [change.time for change in self.velocity_changes]
        if times != sorted(times):
            raise InputError(f"velocity_changes: are at {times} s; they must be in order")
        if self.velocities and len(self.velocities) != self.team.robots:
            raise InputError(
                f"velocities: {len(self.velocities)} for {self.team.robots} robots; one each"
            )
        for command in (*self.commands, *(change.velocity for change in self.velocity_changes)):
            if math.hypot(command.vx, command.vy) > 1.5 or abs(command.wz) > 1.5:
                raise InputError(f"velocity: {command} is over 1.5 m/s or 1.5 rad/s")
        require_number("duration", self.duration, TIMESTEP, LONGEST, "s")
        if self.distance is not None:
            require_number("distance", self.distance, 1e-3, math.inf, "m")
        if self.friction is not None:
            require_number("friction", self.friction, 0.01, 10.0)
        require_seed("seed", self.seed)
        require_number("ramp", self.ramp, 0.0, LONGEST, "s")
        self.sensors.settings(self.seed)
        if self.tracking == "reduced":
            self._require_reducible()

    def _require_reducible(self) -> None:
        """Raises InputError for what rigid bodies on massless legs and level ground know not of."""
        if self.ground.kind != "flat" or self.ground.step:
            raise InputError("tracking: 'reduced' has flat ground only")
        if self.sensors != Sensors():
            raise InputError("tracking: 'reduced' has no sensors; theirs must be left out")
        if any(isinstance(force, Rope) for force in self.disturbances):
            raise InputError("tracking: 'reduced' has forces only, no rope")

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

    @property
    def planner_settings(self) -> LayeredSettings:
        """Weights, horizon and rows of the planner."""
        return SETTINGS[self.tracking]

    def build_planner(self, settings: LayeredSettings | None = None) -> Planner:
        """The scenario's planner; with other settings where they are given."""
        settings = settings or self.planner_settings
        return build_planner(self.planner, self.team, self.assumed_friction, settings)

    def at(self, time: float, pose: NDArray[np.float64], period: float) -> Orders:
        """As of `Director`: the robots' commands, and the gait changes that have come due since
        the last tick.
        """
        due = tuple(c for c in self.gait_changes if 0 <= time + 1e-9 - c.time < period)
        return Orders(tuple(self.command(i, time) for i in range(self.team.robots)), due)

    def gait_of(self, robot: int, time: float) -> Gait:
        """The gait that a robot was last told at `time`, s."""
        told = [self.gait]
        for change in sorted(self.gait_changes, key=lambda change: change.time):
            if change.time <= time and self.names[robot] in (change.robots or self.names):
                told.append(change.gait)
        return told[-1].gait

    def command(self, robot: int, time: float) -> Velocity:
        """Of `robot` at `time` (s): nothing while it stands, then growing to the full command, and
        from a change on that.
        """
        for change in reversed(self.velocity_changes):
            if change.time <= time + 1e-9 and self.names[robot] in (change.robots or self.names):
                return change.velocity
        full = self.commands[robot]
        since = time - STANDING_TIME
        share = min(1.0, max(0.0, since / self.ramp)) if self.ramp else float(since >= 0)
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
    if isinstance(value, Strict):
        return value.model_dump(mode="json")
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
