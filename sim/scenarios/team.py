"""What a scene holds: the robots of a team, their payload and the ground under them."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from palanquin.errors import ProblemError
from palanquin.problems.modules.obstacles import padded_obstacles
from palanquin.problems.robots import LAIKAGO, SingleRigidBody, quadruped
from palanquin.problems.terrains import Terrain
from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.ground import terrain_of


@dataclass(frozen=True)
class Member:
    """One robot: `name`, `kind` (a quadruped's name), the grasp point `attach` [3] in the payload
    frame (m), the robot's nominal `yaw_offset` to the payload (rad), and the planner's lumped
    `body`.
    """

    name: str
    kind: str
    attach: tuple[float, ...]
    yaw_offset: float = 0.0
    body: SingleRigidBody = LAIKAGO.lumped


@dataclass(frozen=True)
class Payload:
    """A body of full extents `size` [3] (m) and `mass` (kg), centred at the payload frame: a box,
    or a cylinder along `axis` ("x", "y" or "z").

    The scene gives it the inertia of that shape at uniform density. The planner may use another:
    Table I's diag(1.6, 24, 1.6) is of no rigid body, since 24 > 1.6 + 1.6, and MuJoCo refuses it.
    """

    mass: float = 16.0
    size: tuple[float, ...] = (0.08, 2.0, 0.08)
    axis: str = ""


@dataclass(frozen=True)
class Ditch:
    """A ditch of width `d` (m) along the line a x + b y + c = 0 (CLM paper, Figure 4)."""

    a: float
    b: float
    c: float
    d: float


@dataclass(frozen=True)
class Team:
    """Robots, payload, terrain (as of `terrain_of`), ditches, and obstacles: rows (x, y, yaw, half
    length, half width, rounding, top) of upright prisms (m, rad).

    Raises InputError for an unknown kind or terrain, repeated names, non-finite numbers, an
    attach point that is no 3-vector, sizes or masses that are not positive, or a ditch without
    a direction.
    """

    robots: tuple[Member, ...]
    payload: Payload = Payload()
    terrain: Mapping[str, Any] = field(default_factory=lambda: {"type": "flat", "z0": 0.0})
    ditches: tuple[Ditch, ...] = ()
    obstacles: tuple[tuple[float, ...], ...] = ()

    def __post_init__(self) -> None:
        names = [robot.name for robot in self.robots]
        if not names:
            raise InputError("team.robots: at least one robot is needed")
        if len({"payload", "terrain", *names}) < len(names) + 2:
            raise InputError(f"team.robots: names {names} must differ, also from payload, terrain")
        if not all(names) or any("/" in name for name in names):
            raise InputError(f"team.robots: names {names} must not be empty and have no '/'")
        for robot in self.robots:
            quadruped(robot.kind)
            _check_vector(f"{robot.name}.attach", robot.attach)
        _check_vector("payload.size", self.payload.size)
        if min(self.payload.size) <= 0 or not self.payload.mass > 0:
            raise InputError(f"payload: {self.payload} must have positive size and mass")
        if self.payload.axis not in ("", "x", "y", "z"):
            raise InputError(f"payload.axis: {self.payload.axis!r} is none of '', 'x', 'y', 'z'")
        for ditch in self.ditches:
            if not np.hypot(ditch.a, ditch.b) > 0 or not ditch.d > 0:
                raise InputError(f"ditch: {ditch} needs a direction (a, b) and a positive width d")
        try:
            padded_obstacles(self.obstacles, len(self.obstacles))
        except ProblemError as error:
            raise InputError(f"team: {error}") from error
        terrain_of(self.terrain)  # raises for a bad one

    @property
    def names(self) -> tuple[str, ...]:
        """Of the robots."""
        return tuple(robot.name for robot in self.robots)

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of all bodies: the payload, then the robots."""
        return ("payload", *self.names)

    @cached_property
    def ground(self) -> Terrain:
        """The terrain as a height map."""
        return terrain_of(self.terrain)

    def to_json(self) -> str:
        """The team as JSON text."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> "Team":
        """The inverse of `to_json`; raises InputError when the text is not a team's."""
        try:
            data = json.loads(text)
            return cls(
                robots=tuple(_member(robot) for robot in data["robots"]),
                payload=Payload(**{k: _tuples(v) for k, v in data["payload"].items()}),
                terrain=data["terrain"],
                ditches=tuple(Ditch(**ditch) for ditch in data["ditches"]),
                obstacles=_tuples(data.get("obstacles", [])),
            )
        except (KeyError, TypeError, json.JSONDecodeError) as error:
            raise InputError(f"team: not a valid description ({error})") from error


def _member(data: dict[str, Any]) -> Member:
    body = {key: _tuples(value) for key, value in data.pop("body").items()}
    return Member(**{key: _tuples(v) for key, v in data.items()}, body=SingleRigidBody(**body))


def _tuples(value: Any) -> Any:
    return tuple(_tuples(v) for v in value) if isinstance(value, list) else value


def _check_vector(name: str, vector: Sequence[float]) -> None:
    if len(vector) != 3 or not np.all(np.isfinite(vector)):
        raise InputError(f"{name}: {vector} must be three finite numbers")
