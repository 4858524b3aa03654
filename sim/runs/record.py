"""The record of a run, one entry per planning period: the same for every plant."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol
from zipfile import BadZipFile

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palanquin.events import Event, EventKind
from palanquin.sim.errors import InputError

Array = NDArray[np.float64]

_FORMAT = 3
_FINITE = ("time", "x", "reference", "contact", "feet", "plan_x", "plan_feet", "plan_contact")
_GROUPS = ("phases", "violation", "more")


class RecordedTeam(Protocol):
    """Who moves."""

    @property
    def names(self) -> tuple[str, ...]:
        """Of the robots."""

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of all bodies in the order of the states."""

    def to_json(self) -> str:
        """The team as JSON text, of which `team_from_json` makes one again."""


def tick_shapes(bodies: int, robots: int, horizon: int) -> dict[str, tuple[int, ...]]:
    """Shape of each per-tick array for B `bodies`, R `robots` and N = `horizon` intervals."""
    nx = 13 * bodies
    return {
        "time": (),
        "x": (nx,),
        "reference": (nx,),
        "contact": (robots, 4),
        "feet": (robots, 4, 3),
        "force": (robots, 4, 3),
        "plan_x": (horizon + 1, nx),
        "plan_feet": (horizon, robots, 4, 3),
        "plan_contact": (horizon, robots, 4),
        "solve_ms": (),
        "iterations": (),
        "cost": (),
        "equality_violation": (),
    }


@dataclass
class Record:
    """T ticks of a team of R robots and B bodies planned over N intervals; feet are LF, RF, LH, RH.

    | field | shape | meaning |
    |---|---|---|
    | `time` | [T] | start of each period, increasing (s) |
    | `x` | [T, 13 B] | measured state, in the order of `team.bodies`: a payload in hands, then the
      robots; on bars the robots. Each has position (m), quaternion (w, x, y, z) body to world,
      velocity (m/s, world), angular velocity (rad/s, body) |
    | `reference` | [T, 13 B] | the reference of that state |
    | `contact` | [T, R, 4] | 1 where a foot stands during the period that starts at `time` |
    | `feet` | [T, R, 4, 3] | world positions (m) of the contact points; of a swing foot of the
      nominal model, the plan's value |
    | `force` | [T, R, 4, 3] | the plan's ground reaction forces during the period (N, world) |
    | `plan_x` | [T, N+1, 13 B] | planned states at `time + plan_time` |
    | `plan_feet` | [T, N, R, 4, 3] | planned feet, world (m) |
    | `plan_contact` | [T, N, R, 4] | planned contact flags |
    | `plan_time` | [N+1] | times of the knots relative to the tick (s), the first is 0 |
    | `solve_ms`, `iterations`, `cost`, `equality_violation` | [T] | the solver's figures; NaN what
      it doesn't tell |
    | `status` | [T] | the solver's word on each solve |
    | `usable` | [T] | whether the plan was one; if not, the last one was followed on |
    | `phases` | name: [T] | time of each phase of a solve (ms) |
    | `violation` | family: [T] | worst violation of each inequality family, in its unit |
    | `more` | name: [T, ...] | what only some planners and plants have, see below |
    | `events` | | what the planner did other than full steps, with times |
    | `period` | | between two ticks, s |
    | `duration` | | of the run, s |
    | `fall` | | why the run ended early, in words; empty if it did not |
    | `wall` | | time that the run took, s |
    | `extremes` | name: number | worst values of the whole run, as the plant tells |

    In `more`: of hands `hand_wrench` [T, R, 6], force (N) and torque (N m) of the payload on the
    robot, world; `disturbance` [T, B, 6], mean force (N) and torque (N m) of pushes on each body
    during the period, world, where it is the plant that is told of them; of planners that observe
    `observed_wrench` [T, B, 6], unknown force (N) and torque (N m) on each body, world, that the
    plan counts on, and `apparent_payload_mass` [T], kg. Of robots on bars
    `estimates` [T, R, L], the multipliers as each robot's planner knows them, and in reduced order
    `multipliers` [T, L], the true ones (N/m for a free bar). In physics `foot_force` [T, R, 4, 3]
    of the ground on the feet at the period's end (N, world), `qpos` [T, nq] of the scene at its
    start, `bars` [T, R-1, 7], their poses then, and `output_error` [T, R, 6], virtual constraints:
    position (m), orientation (rad); of hands also `torque_share` [T, R, 16], the motors' torques at
    the period's end over their limits, in the order of `scenes.inverse_kinematics.JOINTS`, and
    where the state is not known, `true_bodies` [T, B, 13] and `true_feet` [T, R, 4, 3] as they are,
    and `known_force`, `foot_force` as the robots know it.

    Build it with `RecordBuilder` or `load`. Construction raises InputError that names the array,
    its shape and the expected one, or a value that breaks a rule.
    """

    team: Any
    plan_time: Array
    time: Array
    x: Array
    reference: Array
    contact: Array
    feet: Array
    force: Array
    plan_x: Array
    plan_feet: Array
    plan_contact: Array
    solve_ms: Array
    iterations: Array
    cost: Array
    equality_violation: Array
    status: NDArray[np.str_]
    usable: NDArray[np.bool_]
    phases: dict[str, Array]
    violation: dict[str, Array]
    period: float
    duration: float
    more: dict[str, Array] = field(default_factory=dict)
    events: tuple[Event, ...] = ()
    fall: str = ""
    wall: float = 0.0
    extremes: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _check_plan_time(self.plan_time)
        ticks = np.shape(self.time)[0] if np.ndim(self.time) else 0
        if ticks == 0:
            raise InputError("record.time: at least one tick is needed")
        for name, shape in self._shapes().items():
            _check_array(name, getattr(self, name), (ticks, *shape))
        for group in ("phases", "violation"):
            for name, values in getattr(self, group).items():
                _check_array(f"{group}[{name!r}]", values, (ticks,))
        for name, values in self.more.items():
            _check_array(f"more[{name!r}]", values, (ticks, *np.shape(values)[1:]))
        for name in ("status", "usable"):
            if np.shape(getattr(self, name)) != (ticks,):
                shape = np.shape(getattr(self, name))
                raise InputError(f"record.{name}: {shape} instead of {(ticks,)}")
        if np.any(np.diff(self.time) <= 0):
            raise InputError("record.time: must increase from tick to tick")
        if np.any(np.abs(np.linalg.norm(self.bodies[..., 3:7], axis=-1) - 1) > 1e-3):
            raise InputError("record.x: an orientation is no unit quaternion (norm off by > 1e-3)")

    def _shapes(self) -> dict[str, tuple[int, ...]]:
        return tick_shapes(len(self.team.bodies), self.robots, self.horizon)

    @property
    def robots(self) -> int:
        """R, the number of robots."""
        return len(self.team.names)

    @property
    def horizon(self) -> int:
        """N, the number of planned intervals."""
        return len(self.plan_time) - 1

    @property
    def bodies(self) -> Array:
        """Measured states [T, B, 13]."""
        return self.x.reshape(len(self.time), -1, 13)

    @property
    def true_bodies(self) -> Array:
        """States [T, B, 13] as they are: those measured, where nothing else is told."""
        return self.more.get("true_bodies", self.bodies)

    @property
    def true_feet(self) -> Array:
        """The same of contact points [T, R, 4, 3], m."""
        return self.more.get("true_feet", self.feet)

    @property
    def references(self) -> Array:
        """References of the states [T, B, 13]."""
        return self.reference.reshape(len(self.time), -1, 13)

    @property
    def planned(self) -> Array:
        """Planned states [T, N+1, B, 13]."""
        return self.plan_x.reshape(*self.plan_x.shape[:2], -1, 13)

    def save(self, path: Path) -> None:
        """Write everything to `path` (compressed NPZ, no pickles)."""
        arrays = {name: getattr(self, name) for name in self._shapes()}
        for group in (*_GROUPS, "extremes"):
            arrays |= {f"{group}/{name}": v for name, v in getattr(self, group).items()}
        arrays |= {f"events/{name}": values for name, values in _event_arrays(self.events).items()}
        for name in ("plan_time", "status", "usable", "period", "duration", "fall", "wall"):
            arrays[name] = np.array(getattr(self, name))
        np.savez_compressed(
            path,
            allow_pickle=False,
            format=np.array(_FORMAT),
            team=np.array(self.team.to_json()),
            **arrays,
        )

    @classmethod
    def load(cls, path: Path) -> Record:
        """Read what `save` wrote; raises InputError when the file is not a record."""
        from palanquin.sim.runs.teams import team_from_json

        data = _read_arrays(path)
        groups: dict[str, Any] = {name: {} for name in (*_GROUPS, "extremes", "events")}
        try:
            for name in [name for name in data if "/" in name]:
                group, _, key = name.partition("/")
                groups[group][key] = data.pop(name)
            groups["extremes"] = {k: float(v) for k, v in groups["extremes"].items()}
            data |= {name: float(data[name]) for name in ("period", "duration", "wall")}
            data["fall"] = str(data["fall"])
            groups["events"] = _events(**groups["events"])
            return cls(team=team_from_json(str(data.pop("team"))), **data, **groups)
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"{path}: not a record ({error})") from error


def _event_arrays(events: Sequence[Event]) -> dict[str, NDArray[Any]]:
    return {
        "time": np.array([event.time for event in events], dtype=float),
        "kind": np.array([event.kind.value for event in events], dtype=np.str_),
        "reason": np.array([event.reason for event in events], dtype=np.str_),
    }


def _events(
    time: ArrayLike = (), kind: ArrayLike = (), reason: ArrayLike = ()
) -> tuple[Event, ...]:
    return tuple(
        Event(float(t), EventKind(str(k)), str(r))
        for t, k, r in zip(*map(np.atleast_1d, (time, kind, reason)), strict=True)
    )


def _read_arrays(path: Path) -> dict[str, Any]:
    with open(path, "rb") as stream:
        try:
            with np.load(stream, allow_pickle=False) as file:
                data = {name: file[name] for name in file.files}
        except (OSError, ValueError, EOFError, AttributeError, BadZipFile) as error:
            raise InputError(f"{path}: not a record ({error})") from error
    if data.pop("format", None) != _FORMAT:
        raise InputError(f"{path}: not a record of format {_FORMAT}")
    return data


class RecordBuilder:
    """Collects a record tick by tick.

    `plan_time` [N+1] as in `Record`. Every tick must have the names of the first one.
    """

    def __init__(self, team: RecordedTeam, plan_time: Sequence[float] | Array) -> None:
        self._team = team
        self._plan_time = np.array(plan_time, float)
        _check_plan_time(self._plan_time)
        self._shapes = tick_shapes(len(team.bodies), len(team.names), len(self._plan_time) - 1)
        self._ticks: list[dict[str, Any]] = []
        self._groups: list[dict[str, Mapping[str, Any]]] = []
        self._words: list[tuple[str, bool]] = []
        self._events: list[Event] = []

    def __len__(self) -> int:
        return len(self._ticks)

    def append(
        self,
        *,
        status: str,
        usable: bool = True,
        phases: Mapping[str, float] | None = None,
        violation: Mapping[str, float] | None = None,
        more: Mapping[str, Any] | None = None,
        events: Sequence[Event] = (),
        **values: Any,
    ) -> None:
        """Add one tick: `values` are the per-tick arrays of `Record` by name.

        Raises InputError for a missing, unknown or misshapen value; numbers are looked at when the
        record is built.
        """
        _check_names("tick", values, self._shapes)
        for name, shape in self._shapes.items():
            if getattr(values[name], "shape", None) != shape:  # an array's is at hand
                _check_shape(name, values[name], shape)
        groups = {"phases": phases or {}, "violation": violation or {}, "more": more or {}}
        for name, group in groups.items():
            _check_names(name, group, (self._groups or [groups])[0][name])
        self._ticks.append(values)
        self._groups.append(groups)
        self._words.append((str(status), bool(usable)))
        self._events += events

    def build(self, period: float, **rest: Any) -> Record:
        """The ticks so far, checked; `rest` are the fields of the whole run."""
        if not self._ticks:
            raise InputError("record.time: at least one tick is needed")
        arrays: dict[str, Any] = {name: np.array([tick[name] for tick in self._ticks], float)
                  for name in self._shapes}  # fmt: skip
        groups: dict[str, Any] = {
            group: {name: np.array([g[group][name] for g in self._groups]) for name in names}
            for group, names in self._groups[0].items()
        }
        status, usable = zip(*self._words, strict=True)
        return Record(
            self._team,
            self._plan_time,
            **arrays,
            status=np.array(status, dtype=np.str_),
            usable=np.array(usable, dtype=bool),
            **groups,
            events=tuple(self._events),
            period=period,
            **{"duration": len(self) * period, **rest},
        )


def _check_names(where: str, given: Mapping[str, Any], expected: Mapping[str, Any]) -> None:
    if given.keys() != expected.keys():
        missing = sorted(expected.keys() - given.keys())
        unknown = sorted(given.keys() - expected.keys())
        raise InputError(f"record {where}: missing {missing}, unknown {unknown}")


def _check_plan_time(plan_time: Array) -> None:
    if np.ndim(plan_time) != 1 or len(plan_time) < 2:
        raise InputError(f"record.plan_time: shape {np.shape(plan_time)} instead of (N+1,), N >= 1")
    if plan_time[0] != 0 or not np.all(np.diff(plan_time) > 0):
        raise InputError("record.plan_time: must start at 0 and increase")


def _check_shape(name: str, value: Any, shape: tuple[int, ...]) -> None:
    if np.shape(value) != shape:
        raise InputError(f"record.{name}: shape {np.shape(value)} instead of {shape}")


def _check_array(name: str, value: Any, shape: tuple[int, ...]) -> None:
    _check_shape(name, value, shape)
    if name in _FINITE and not np.all(np.isfinite(np.asarray(value, float))):
        raise InputError(f"record.{name}: every value must be finite")
