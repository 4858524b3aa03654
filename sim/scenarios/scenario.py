"""A scenario: who carries what, on what ground, told to move how, and what befalls them."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, PrivateAttr, ValidationError, model_validator

from palanquin.problems import clm
from palanquin.problems.clm.planner import Planner
from palanquin.problems.clm.references import nominal_state
from palanquin.problems.clm.team_plan import TeamState
from palanquin.problems.gaits import Gait
from palanquin.problems.modules.obstacles import Obstacles
from palanquin.problems.terrain_kinds import FlatKind, TerrainKind
from palanquin.problems.terrains import Terrain
from palanquin.schema import Positive, Seed, Strict, dotted, faults
from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.command import AnyCommand
from palanquin.sim.scenarios.disturbance import Push
from palanquin.sim.scenarios.ditches import Ditches, Line, ListedDitches
from palanquin.sim.scenarios.faults import AnyFault, FaultOfRobot
from palanquin.sim.scenarios.gait import GaitChange
from palanquin.sim.scenarios.obstacles import AnyObstacle
from palanquin.sim.scenarios.payload import Payload
from palanquin.sim.scenarios.robot import Robot
from palanquin.sim.scenarios.script import Script
from palanquin.sim.scenarios.sensing import KnownState, Sensing
from palanquin.sim.scenarios.settings import PlannerSettings
from palanquin.sim.scenarios.start import disturbed
from palanquin.sim.scenarios.start_pose import StartPose
from palanquin.sim.scenarios.team import Ditch, Team
from palanquin.sim.scenarios.vectors import Name
from palanquin.sim.scenarios.world import World

MOST_ROBOTS = 4

_NO_DITCHES = ListedDitches(type="lines", lines=())


class Scenario(Strict):
    """One run, as data. The same fields stand in scenario files (YAML or JSON).

    Use `changed` for a variant. A bad value raises InputError, or pydantic's ValidationError when
    the constructor is called.
    """

    name: Name = Field(description="of its files and figures; in a file, that file's unless told")
    summary: str = Field("", description="what one should see, in a sentence")
    robots: Annotated[
        tuple[Robot, ...], Field(strict=False, min_length=1, max_length=MOST_ROBOTS)
    ] = Field(description="who carries")
    payload: Payload = Field(Payload(), description="what they carry")
    terrain: TerrainKind = FlatKind(type="flat")
    ditches: Ditches = Field(_NO_DITCHES, description="strips of ground that no foot may touch")
    obstacles: Annotated[tuple[AnyObstacle, ...], Field(strict=False, max_length=50)] = Field(
        (), description="what robots and payload keep clear of, and then also of each other"
    )
    start_pose: StartPose = StartPose()
    command: AnyCommand = Field(description="how the payload shall move")
    gait_changes: Annotated[tuple[GaitChange, ...], Field(strict=False)] = Field(
        (), description="on the way"
    )
    pushes: Annotated[tuple[Push, ...], Field(strict=False)] = Field(
        (), description="that disturb them"
    )
    faults: Annotated[tuple[AnyFault, ...], Field(strict=False)] = Field(
        (), description="what breaks in full physics"
    )
    planner: PlannerSettings = Field(PlannerSettings(), description="how they plan")
    world: World = Field(World(), description="that full physics simulates")
    state: KnownState = Field(
        "true",
        description="what planner and controllers know in full physics: the state itself, with "
        "white noise, or what an estimator makes of sensors",
    )
    sensors: Sensing = Field(Sensing(), description="what that noise and those sensors are")
    duration: Positive = Field(10.0, description="of the run, s")
    seed: Seed = Field(
        0,
        description="of random ditches and of the start: 0 stands nominally, from 1 on bodies, "
        "velocities and feet are a little off",
    )
    tracking: Literal["physics", "kinematic"] | None = Field(
        None,
        description="how the plan is followed: in simulated physics under torque limits, as a demo "
        "does unless told, or exactly, the joints by inverse kinematics",
    )
    carry: Literal["hands"] = Field("hands", description="what carries; bars have fields of theirs")
    _lines: list[Line] = PrivateAttr()

    @model_validator(mode="after")
    def _check_names(self) -> Self:
        names = [robot.name for robot in self.robots]
        if len({"payload", "terrain", *names}) < len(names) + 2:
            raise ValueError(f"robots: names {names} must differ, also from payload and terrain")
        for i, change in enumerate(self.gait_changes):
            for name in change.robots:
                if name not in names:
                    raise ValueError(f"gait_changes[{i}].robots: {name!r} is not one of {names}")
        for i, push in enumerate(self.pushes):
            if push.body not in self.bodies:
                raise ValueError(f"pushes[{i}].body: {push.body!r} is not one of {self.bodies}")
        for i, fault in enumerate(self.faults):
            if isinstance(fault, FaultOfRobot) and fault.whose(self.names) not in names:
                raise ValueError(f"faults[{i}].robot: {fault.robot!r} is not one of {names}")
        self._lines = self.ditches.draw(self.seed)
        return self

    @model_validator(mode="after")
    def _require_physics(self) -> Self:
        if self.tracking == "kinematic" and self.state != "true":
            raise ValueError(f"state: is {self.state!r}; a kinematic run has no sensors")
        if self.tracking == "kinematic" and self.faults:
            raise ValueError("faults: a kinematic run has nothing that could break")
        return self

    @model_validator(mode="after")
    def _require_steps(self) -> Self:
        starts = {0.0, *self.command.changes(), *(change.time for change in self.gait_changes)}
        for time in sorted(starts):
            if not self.command.moves(time):
                continue
            for robot in self.robots:
                gait = self.gait_of(robot, time)
                if min(gait.duty) >= 1.0:
                    raise ValueError(
                        f"command: at {time:g} s the velocity must be 0 with the gait "
                        f"'{gait.name}' of {robot.name}, whose feet never move"
                    )
        return self

    def gait_of(self, robot: Robot, time: float) -> Gait:
        """The gait that a robot was last told at a time, s."""
        told = [robot.gait]
        for change in sorted(self.gait_changes, key=lambda change: change.time):
            if change.time <= time and robot.name in (change.robots or (robot.name,)):
                told.append(change.gait)
        return told[-1].gait

    def changed(self, **fields: Any) -> Scenario:
        """A copy with other values; raises InputError that names the field and the rule."""
        data = {**dict(self), **fields}
        try:
            return type(self).model_validate(data)
        except ValidationError as error:
            lines = [f"{dotted(path)}: {message}" for path, message in faults(error, data)]
            raise InputError("; ".join(line.removeprefix(": ") for line in lines)) from error

    @property
    def names(self) -> tuple[str, ...]:
        """Of the robots."""
        return tuple(robot.name for robot in self.robots)

    @property
    def bodies(self) -> list[str]:
        """Names of all bodies: the payload, then the robots."""
        return ["payload", *(robot.name for robot in self.robots)]

    @property
    def ground(self) -> Terrain:
        """The height map."""
        return self.terrain.shape()

    @property
    def ditch_lines(self) -> tuple[Line, ...]:
        """The ditches that the seed draws."""
        return tuple(self._lines)

    @property
    def team(self) -> clm.Team:
        """The team as the planner knows it."""
        carriers = tuple(robot.carrier() for robot in self.robots)
        return clm.Team(self.payload.carried(), carriers, self.planner.feet_below)

    @property
    def scene(self) -> Team:
        """The team on its ground as it is simulated and shown."""
        return Team(
            robots=tuple(robot.member() for robot in self.robots),
            payload=self.payload.shape.in_scene(self.world.payload_mass or self.payload.mass),
            terrain=self.terrain.model_dump(),
            ditches=tuple(Ditch(*line) for line in self._lines),
            obstacles=tuple(obstacle.row() for obstacle in self.obstacles),
        )

    def _obstacles(self) -> Obstacles | None:
        """As the planner knows them."""
        rows = [obstacle.row() for obstacle in self.obstacles]
        extents, clearance = self.payload.shape.extents, self.planner.clearance
        return Obstacles(len(rows), extents, rows, clearance) if rows else None

    def build_planner(self, **options: Any) -> Planner:
        """A planner of the scenario; options are fields of `SqpSettings` that override its own."""
        settings, team = self.planner, self.team
        margin = 2 * settings.ditch_margin
        ditches = [(a, b, c, width + margin) for a, b, c, width in self._lines]
        problem = clm.build_clm(
            team,
            settings.horizon,
            settings.dt,
            self.ground,
            settings.friction,
            len(self._lines),
            settings.weights.weights(),
            self._obstacles(),
            holds_inputs=settings.input_blocks > 1,
            limits=settings.limits(),
        )
        observes = settings.observers
        observers = observes.observers(self.payload.mass) if observes else None
        options = {**settings.options(), **options}
        planner = Planner(problem, self.ground, ditches, team=team, observers=observers, **options)
        for family, penalty in settings.penalties.items():
            planner.set_policy(family, penalty.policy())
        return planner

    def start(self, planner: Planner) -> TeamState:
        """Where the run begins, as the seed says; the planner starts over from there."""
        planner.restart(self.start_pose.draw(self.seed))
        return self.start_state()

    def start_state(self) -> TeamState:
        """The bodies and feet with which the run begins, as the seed says."""
        pose = self.start_pose.draw(self.seed)
        nominal = nominal_state(self.team, self.ground, pose, self.planner.references)
        return disturbed(TeamState(*nominal), self.ground, self.seed)

    def script(self) -> Script:
        """The run's commands, gait changes and pushes, as the closed loop asks for them."""
        return Script(self.command.start(), self.gait_changes, self.pushes)

    def described(self) -> str:
        """What one should see."""
        return self.summary
