"""Command files: what a team was told in a session, one JSON object a line.

    {"palanquin": "commands", "version": 1}
    {"time": 0.5, "velocity": {"vx": 0.2, "vy": 0.0, "wz": 0.0}}
    {"time": 1.2, "gait": {"gait": "pace", "robots": []}}
    {"time": 3.0, "push": {"body": "left", "force": [0, 164, 0], "duration": 0.3}}
    {"end": 12.5}

Of robots on bars a velocity that not all of them have says whose it is, `"robots": ["left"]`.
The last line tells a complete file from one that was cut off.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import Annotated, Any, Literal, Self, TextIO, TypeVar

from numpy.typing import NDArray
from pydantic import Field, ValidationError, model_validator

from palanquin.problems.planning import Velocity
from palanquin.schema import Finite, NonNegative, Positive, Strict, dotted, faults
from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.bars import BarScenario
from palanquin.sim.scenarios.command import VelocityChange
from palanquin.sim.scenarios.gait import GaitChange, GaitChoice
from palanquin.sim.scenarios.scenario import Scenario
from palanquin.sim.scenarios.script import Director, Orders
from palanquin.sim.scenarios.vectors import Name, Vector
from palanquin.user_files import read_text

_Line = TypeVar("_Line", bound=Strict)

_HEADER = {"palanquin": "commands", "version": 1}


class CommandFileError(InputError):
    """A command file that cannot be replayed; the message names file and line."""


class _Header(Strict):
    palanquin: Literal["commands"]
    version: Literal[1]


class _Velocity(Strict):
    vx: Finite
    vy: Finite
    wz: Finite
    robots: Annotated[tuple[Name, ...], Field(strict=False)] = ()


class _Gait(Strict):
    gait: GaitChoice
    robots: Annotated[tuple[Name, ...], Field(strict=False)] = ()
    at_once: bool = False


class _Push(Strict):
    body: Name
    force: Vector = (0.0, 0.0, 0.0)
    torque: Vector = (0.0, 0.0, 0.0)
    duration: Positive


class _Event(Strict):
    time: NonNegative
    velocity: _Velocity | None = None
    gait: _Gait | None = None
    push: _Push | None = None

    @model_validator(mode="after")
    def _require_one(self) -> Self:
        if (self.velocity, self.gait, self.push).count(None) != 2:
            raise ValueError("exactly one of velocity, gait, push is needed")
        return self


class _End(Strict):
    end: Positive


class CommandRecorder:
    """Directs a run as another director does, and writes down what that one orders.

    Use as a context: the end of the file is written when it closes, whatever happened.

    Args:
        director: whose orders they are.
        path: of the file.
        robots: names of those that have velocities of their own; none of a payload in hands.
    """

    def __init__(self, director: Director, path: Path, robots: tuple[str, ...] = ()) -> None:
        self._director = director
        self._path, self._robots = path, robots
        self._last = Orders((Velocity(),) * max(len(robots), 1))
        self._end = 0.0

    def __enter__(self) -> Self:
        self._file: TextIO = self._path.open("w", encoding="utf-8")
        self._write(_HEADER)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._end > 0:
            self._write({"end": self._end})
        self._file.close()

    def at(self, time: float, pose: NDArray[Any], period: float) -> Orders | None:
        """As of `Director`."""
        orders = self._director.at(time, pose, period)
        if orders is None:
            return None
        for event in _events(orders, self._last, self._robots):
            self._write({"time": time, **event})
        self._last, self._end = orders, time + period
        return orders

    def _write(self, line: dict[str, Any]) -> None:
        self._file.write(json.dumps(line, allow_nan=False) + "\n")
        self._file.flush()


def _events(orders: Orders, last: Orders, robots: tuple[str, ...]) -> Iterator[dict[str, Any]]:
    """What is new in `orders`."""
    changed = [i for i in range(max(len(robots), 1)) if orders.of(i) != last.of(i)]
    velocities = {orders.of(i) for i in changed}
    if len(velocities) == 1 and len(changed) == max(len(robots), 1):
        yield {"velocity": asdict(*velocities)}
    else:
        for i in changed:
            yield {"velocity": {**asdict(orders.of(i)), "robots": [robots[i]]}}
    for change in orders.gait_changes:
        yield {"gait": change.model_dump(mode="json", exclude={"time"}, exclude_none=True)}
    for push in orders.pushes:
        if push not in last.pushes:
            yield {"push": push.model_dump(mode="json", exclude={"start", "known"})}


def replayed_on_bars(scenario: BarScenario, path: Path) -> BarScenario:
    """The same of robots on bars, who are not pushed by hand; raises as `replayed`."""
    events, end = _read(path)
    try:
        if any(event.push for event in events):
            raise InputError("push: robots on bars are not pushed by hand")
        return scenario.changed(
            velocity=Velocity(),
            velocities=(),
            velocity_changes=tuple(
                VelocityChange(time=e.time, **dict(e.velocity)) for e in events if e.velocity
            ),
            gait_changes=tuple(GaitChange(time=e.time, **dict(e.gait)) for e in events if e.gait),
            duration=end,
            distance=None,
        )
    except InputError as error:
        raise CommandFileError(f"{path}: not for scenario '{scenario.name}': {error}") from error


def replayed(scenario: Scenario, path: Path) -> Scenario:
    """The scenario with the commands, gait changes and pushes of a file, and as long as it.

    Raises CommandFileError that names the line of a fault, or says that the file was cut off.
    """
    events, end = _read(path)
    velocities = [(e.time, e.velocity) for e in events if e.velocity]
    steps = [{"time": time, "vx": v.vx, "vy": v.vy, "wz": v.wz} for time, v in velocities]
    changes = [{"time": e.time, **dict(e.gait)} for e in events if e.gait]
    pushes = [{"start": e.time, **dict(e.push)} for e in events if e.push]
    try:
        if any(velocity.robots for _, velocity in velocities):
            raise InputError("velocity: a payload in hands has one for all")
        return scenario.changed(
            command={"type": "velocity", "steps": steps or [{}]},
            gait_changes=changes,
            pushes=pushes,
            duration=end,
        )
    except InputError as error:
        raise CommandFileError(f"{path}: not for scenario '{scenario.name}': {error}") from error


def _read(path: Path) -> tuple[list[_Event], float]:
    try:
        lines = read_text(path).splitlines()
    except OSError as error:
        raise CommandFileError(f"{path}: {error.strerror or error}") from error
    except ValueError as error:
        raise CommandFileError(f"{path}: {error}") from error
    if not lines:
        raise CommandFileError(f"{path} is empty; a command file is needed")
    _parsed(_Header, path, lines, 0)
    last = len(lines) - 1
    if last == 0 or not lines[last].startswith('{"end"'):
        raise CommandFileError(
            f"{path}:{last + 1}: the file is cut off: its last line must be the end mark, such as "
            '{"end": 12.5}'
        )
    end = _parsed(_End, path, lines, last).end
    events = [_parsed(_Event, path, lines, n) for n in range(1, last)]
    earlier = 0.0
    for n, event in enumerate(events, start=2):
        if not earlier <= event.time <= end:
            raise CommandFileError(
                f"{path}:{n}: time {event.time:g} s must be from {earlier:g} s, the line before's, "
                f"to {end:g} s, the end's"
            )
        earlier = event.time
    return events, end


def _parsed(kind: type[_Line], path: Path, lines: list[str], n: int) -> _Line:
    data = _json(path, lines, n)
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        found = faults(error, data)
        words = [f"{dotted(where)}: {message}" if where else message for where, message in found]
        raise CommandFileError(f"{path}:{n + 1}: {'; '.join(words)}") from error


def _json(path: Path, lines: list[str], n: int) -> Any:
    try:
        return json.loads(lines[n])
    except RecursionError as error:
        raise CommandFileError(f"{path}:{n + 1}: not JSON: it is nested too deeply") from error
    except ValueError as error:
        cut = ", where the file is cut off" if n == len(lines) - 1 else ""
        reason = error.msg if isinstance(error, json.JSONDecodeError) else error
        raise CommandFileError(f"{path}:{n + 1}: not JSON{cut}: {reason}") from error
