"""The record of a receding-horizon run, one entry per planning period."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palanquin.events import Event, EventKind
from palanquin.sim.errors import InputError
from palanquin.sim.team import Team

Array = NDArray[np.float64]

_FORMAT = 2
_FINITE = ("time", "x", "reference", "contact", "feet", "plan_x", "plan_feet", "plan_contact")


def tick_shapes(robots: int, horizon: int) -> dict[str, tuple[int, ...]]:
    """Shape of each per-tick array for R `robots` and N = `horizon` intervals."""
    nx = 13 * (robots + 1)
    return {
        "time": (),
        "x": (nx,),
        "reference": (nx,),
        "contact": (robots, 4),
        "feet": (robots, 4, 3),
        "force": (robots, 4, 3),
        "hand_wrench": (robots, 6),
        "disturbance": (robots + 1, 6),
        "plan_x": (horizon + 1, nx),
        "plan_feet": (horizon, robots, 4, 3),
        "plan_contact": (horizon, robots, 4),
        "solve_ms": (),
        "iterations": (),
        "cost": (),
        "equality_violation": (),
    }


@dataclass
class Rollout:
    """T ticks of a team of R robots planned over N intervals; feet are LF, RF, LH, RH.

    | field | shape | meaning |
    |---|---|---|
    | `time` | [T] | start of each period, increasing (s) |
    | `x` | [T, 13(R+1)] | measured state: payload, then robots; each position (m), quaternion
      (w, x, y, z) body to world, velocity (m/s, world), angular velocity (rad/s, body) |
    | `reference` | [T, 13(R+1)] | the reference of that state |
    | `contact` | [T, R, 4] | 1 where a foot stands during the period that starts at `time` |
    | `feet` | [T, R, 4, 3] | world positions (m) of the contact points; of a swing foot, the plan's
      value |
    | `force` | [T, R, 4, 3] | ground reaction forces applied during the period (N, world) |
    | `hand_wrench` | [T, R, 6] | force (N) and torque (N m) of the payload on the robot, world |
    | `disturbance` | [T, R+1, 6] | mean force (N) and torque (N m) of pushes on each body, payload
      first, during the period, world |
    | `plan_x` | [T, N+1, 13(R+1)] | planned states at `time + plan_time` |
    | `plan_feet` | [T, N, R, 4, 3] | planned feet, world (m) |
    | `plan_contact` | [T, N, R, 4] | planned contact flags |
    | `plan_time` | [N+1] | times of the knots relative to the tick (s), the first is 0 |
    | `solve_ms`, `iterations`, `cost`, `equality_violation` | [T] | the solver's figures |
    | `status` | [T] | the solver's word on each solve |
    | `phases` | name: [T] | time of each phase of a solve (ms) |
    | `violation` | family: [T] | worst violation of each inequality family, in its unit |
    | `events` | | what the planner did other than full steps, with times |

    Build it with `RolloutBuilder` or `load`. Construction raises InputError that names the array,
    its shape and the expected one, or a value that breaks a rule.
    """

    team: Team
    plan_time: Array
    time: Array
    x: Array
    reference: Array
    contact: Array
    feet: Array
    force: Array
    hand_wrench: Array
    disturbance: Array
    plan_x: Array
    plan_feet: Array
    plan_contact: Array
    solve_ms: Array
    iterations: Array
    cost: Array
    equality_violation: Array
    status: NDArray[np.str_]
    phases: dict[str, Array]
    violation: dict[str, Array]
    events: tuple[Event, ...] = ()

    def __post_init__(self) -> None:
        _check_plan_time(self.plan_time)
        ticks = np.shape(self.time)[0] if np.ndim(self.time) else 0
        if ticks == 0:
            raise InputError("rollout.time: at least one tick is needed")
        for name, shape in tick_shapes(self.robots, self.horizon).items():
            _check_array(name, getattr(self, name), (ticks, *shape))
        for group in ("phases", "violation"):
            for name, values in getattr(self, group).items():
                _check_array(f"{group}[{name!r}]", values, (ticks,))
        if np.shape(self.status) != (ticks,):
            raise InputError(f"rollout.status: {np.shape(self.status)} instead of {(ticks,)}")
        if np.any(np.diff(self.time) <= 0):
            raise InputError("rollout.time: must increase from tick to tick")
        quaternions = self.x.reshape(ticks, -1, 13)[:, :, 3:7]
        if np.any(np.abs(np.linalg.norm(quaternions, axis=-1) - 1) > 1e-3):
            raise InputError("rollout.x: an orientation is no unit quaternion (norm off by > 1e-3)")

    @property
    def robots(self) -> int:
        """R, the number of robots."""
        return len(self.team.robots)

    @property
    def horizon(self) -> int:
        """N, the number of planned intervals."""
        return len(self.plan_time) - 1

    def save(self, path: Path) -> None:
        """Write everything to `path` (compressed NPZ, no pickles)."""
        arrays = {name: getattr(self, name) for name in tick_shapes(self.robots, self.horizon)}
        arrays |= {f"phases/{name}": values for name, values in self.phases.items()}
        arrays |= {f"violation/{name}": values for name, values in self.violation.items()}
        arrays |= {f"events/{name}": values for name, values in _event_arrays(self.events).items()}
        np.savez_compressed(
            path,
            allow_pickle=False,
            format=np.array(_FORMAT),
            team=np.array(self.team.to_json()),
            plan_time=self.plan_time,
            status=self.status,
            **arrays,
        )

    @classmethod
    def load(cls, path: Path) -> "Rollout":
        """Read what `save` wrote; raises InputError when the file is not a rollout."""
        data = _read_arrays(path)
        groups: dict[str, Any] = {"phases": {}, "violation": {}, "events": {}}
        try:
            for name in [name for name in data if "/" in name]:
                group, _, key = name.partition("/")
                groups[group][key] = data.pop(name)
            team = Team.from_json(str(data.pop("team")))
            groups["events"] = _events(**groups["events"])
            return cls(team=team, **data, **groups)
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"{path}: not a rollout ({error})") from error


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
            raise InputError(f"{path}: not a rollout ({error})") from error
    if data.pop("format", None) != _FORMAT:
        raise InputError(f"{path}: not a rollout of format {_FORMAT}")
    return data


class RolloutBuilder:
    """Collects a rollout tick by tick into arrays allocated once.

    `capacity` ticks at most; `plan_time` [N+1] as in `Rollout`; `phases` and `violation` are the
    names that every tick will report.
    """

    def __init__(
        self,
        team: Team,
        plan_time: Sequence[float] | Array,
        capacity: int,
        phases: Sequence[str] = (),
        violation: Sequence[str] = (),
    ) -> None:
        self._team = team
        self._plan_time = np.array(plan_time, float)
        _check_plan_time(self._plan_time)
        if capacity < 1:
            raise InputError(f"capacity: {capacity} must be at least 1")
        shapes = tick_shapes(len(team.robots), len(self._plan_time) - 1)
        self._arrays = {name: np.full((capacity, *s), np.nan) for name, s in shapes.items()}
        self._groups = {
            "phases": {name: np.full(capacity, np.nan) for name in phases},
            "violation": {name: np.full(capacity, np.nan) for name in violation},
        }
        self._status: list[str] = []
        self._events: list[Event] = []
        self._capacity = capacity

    def __len__(self) -> int:
        return len(self._status)

    def append(
        self,
        *,
        status: str,
        phases: Mapping[str, float] | None = None,
        violation: Mapping[str, float] | None = None,
        events: Sequence[Event] = (),
        **values: Any,
    ) -> None:
        """Add one tick: `values` are the per-tick arrays of `Rollout` by name.

        Raises InputError for a missing, unknown or misshapen value, and when full.
        """
        tick = len(self)
        if tick == self._capacity:
            raise InputError(f"rollout: full after {self._capacity} ticks")
        _check_names("tick", values, self._arrays)
        groups = {"phases": phases or {}, "violation": violation or {}}
        for group, entries in groups.items():
            _check_names(group, entries, self._groups[group])
        for name, value in values.items():
            _check_array(name, value, self._arrays[name].shape[1:])
            self._arrays[name][tick] = value
        for group, entries in groups.items():
            for name, entry in entries.items():
                self._groups[group][name][tick] = entry
        self._status.append(str(status))
        self._events += events

    def build(self) -> Rollout:
        """The ticks so far, checked."""
        ticks = len(self)
        arrays: dict[str, Any] = {name: v[:ticks] for name, v in self._arrays.items()}
        groups: dict[str, Any] = {
            group: {name: values[:ticks] for name, values in entries.items()}
            for group, entries in self._groups.items()
        }
        status = np.array(self._status, dtype=np.str_)
        return Rollout(
            self._team,
            self._plan_time,
            status=status,
            events=tuple(self._events),
            **arrays,
            **groups,
        )


def _check_names(where: str, given: Mapping[str, Any], expected: Mapping[str, Any]) -> None:
    missing, unknown = (
        sorted(expected.keys() - given.keys()),
        sorted(given.keys() - expected.keys()),
    )
    if missing or unknown:
        raise InputError(f"rollout {where}: missing {missing}, unknown {unknown}")


def _check_plan_time(plan_time: Array) -> None:
    if np.ndim(plan_time) != 1 or len(plan_time) < 2:
        raise InputError(
            f"rollout.plan_time: shape {np.shape(plan_time)} instead of (N+1,), N >= 1"
        )
    if plan_time[0] != 0 or not np.all(np.diff(plan_time) > 0):
        raise InputError("rollout.plan_time: must start at 0 and increase")


def _check_array(name: str, value: Any, shape: tuple[int, ...]) -> None:
    if np.shape(value) != shape:
        raise InputError(f"rollout.{name}: shape {np.shape(value)} instead of {shape}")
    if name in _FINITE and not np.all(np.isfinite(np.asarray(value, float))):
        raise InputError(f"rollout.{name}: every value must be finite")
