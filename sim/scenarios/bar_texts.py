"""Grounds, loads and forces as short texts, such as a command line takes them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

import numpy as np

from palanquin.problems.planning import Velocity
from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.bar_forces import Force, Rope
from palanquin.sim.scenarios.bar_ground import KINDS, Ground

ROPE = 1.2
"""Length of the rope of `pull`, m."""


def parse_ground(text: str, seed: int = 0, **options: float) -> Ground:
    """`flat`, `rough`, `blocks`, with a height in m: `rough:0.12`."""
    kind, _, height = text.partition(":")
    if kind not in KINDS:
        raise InputError(f"terrain: {text!r}; {', '.join(KINDS)} is needed, such as rough:0.05")
    size = {"height": _number("terrain", text, height)} if height else {}
    return Ground(kind, seed=seed, **size, **options)  # type: ignore[arg-type]


def parse_payload(text: str) -> tuple[float, float]:
    """Mass in kg and place on the bar from 0 (left) to 1: `5`, `5@0.3`."""
    mass, _, place = text.partition("@")
    return _number("payload", text, mass), _number("payload", text, place) if place else 0.5


def parse_velocities(text: str) -> tuple[Velocity, ...]:
    """`VX[,VY[,WZ]]`, or one for each robot between slashes: `0.15/0`."""
    commands = [_vector("velocity", text, part) for part in text.split("/")]
    if any(len(command) > 3 for command in commands):
        raise InputError(f"velocity: {text!r}; VX[,VY[,WZ]] is needed, such as 0.4 or 0.3,0,0.2")
    return tuple(Velocity(*command) for command in commands)


def parse_force(text: str, robots: int) -> tuple[Force | Rope, ...]:
    """Forces from outside on a team of so many `robots`.

    | text | what |
    |---|---|
    | `sin:20`, `sin:20,40,0` | sinusoids of so many N along x, y, z on every robot, with periods of
      1, 0.7 and 0.4 s |
    | `opposed:30` | steady forces of 30 N that press the outer robots together |
    | `push:FX,FY,FZ@FROM,TO` | a push in N on the first robot between two times in s |
    | `pull:VX,VY@FROM,TO` | a rope on the first robot, whose end walks away at so many m/s |

    `push` and `pull` take another robot after a second colon: `push:0,80,0@3,3.2:1`.
    """
    kind, _, rest = text.partition(":")
    if kind not in _FORCES:
        raise InputError(f"force: {text!r} must begin with {', '.join(_FORCES)} and a colon")
    return _FORCES[kind](text, rest, robots)


def _sinusoids(text: str, rest: str, robots: int) -> tuple[Force, ...]:
    amplitude = _vector("force", text, rest)
    if len(amplitude) == 1:
        amplitude *= 3
    return tuple(Force(robot, _three(text, amplitude)) for robot in range(robots))


def _opposed(text: str, rest: str, robots: int) -> tuple[Force, ...]:
    size = _number("force", text, rest)
    return (
        Force.constant(0, (0.0, -size, 0.0)),
        Force.constant(robots - 1, (0.0, size, 0.0)),
    )


def _push(text: str, rest: str, robots: int) -> tuple[Force, ...]:
    value, start, end, robot = _timed(text, rest, robots)
    return (Force.constant(robot, _three(text, value), start, end),)


def _pull(text: str, rest: str, robots: int) -> tuple[Rope, ...]:
    velocity, start, end, robot = _timed(text, rest, robots)
    if len(velocity) != 2 or not any(velocity):
        raise InputError(f"force: {text!r} needs a velocity VX,VY other than 0")
    direction = np.array([*velocity, 0.0]) / math.hypot(*velocity)
    anchor = tuple(float(c) for c in ROPE * direction + np.array([0.0, 0.0, 0.3]))
    rope = (velocity[0], velocity[1], 0.0)
    return (Rope(robot, anchor, rope, slack=ROPE, start=start, end=end),)  # type: ignore[arg-type]


_FORCES: dict[str, Callable[[str, str, int], tuple[Force | Rope, ...]]] = {
    "sin": _sinusoids,
    "opposed": _opposed,
    "push": _push,
    "pull": _pull,
}


def _timed(text: str, rest: str, robots: int) -> tuple[list[float], float, float, int]:
    """Values, start, end and robot of `VALUES@FROM,TO[:ROBOT]`."""
    match = re.fullmatch(r"([^@:]+)@([^@:,]+),([^@:,]+)(?::(\d+))?", rest)
    if match is None:
        raise InputError(f"force: {text!r}; VALUES@FROM,TO is needed, such as push:0,80,0@3,3.2")
    start, end = (_number("force", text, part) for part in match.group(2, 3))
    robot = int(match.group(4) or 0)
    if robot >= robots:
        raise InputError(f"force: {text!r} is on robot {robot}; 0 to {robots - 1} exist")
    return _vector("force", text, match.group(1)), start, end, robot


def _vector(field: str, text: str, part: str) -> list[float]:
    return [_number(field, text, number) for number in part.split(",")]


def _three(text: str, values: list[float]) -> tuple[float, float, float]:
    if len(values) != 3:
        raise InputError(f"force: {text!r} needs three numbers FX,FY,FZ")
    return values[0], values[1], values[2]


def _number(field: str, text: str, part: str) -> float:
    try:
        value = float(part)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{field}: {text!r}; {part!r} is no finite number")
    return value
