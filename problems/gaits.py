"""Gaits: which foot stands when, and a clock that runs apart from any solver.

Feet are ordered LF, RF, LH, RH.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palanquin import _core
from palanquin.errors import ProblemError
from palanquin.problems import checks
from palanquin.problems.mirrored import Mirrored


@dataclass(frozen=True)
class Gait(Mirrored):
    """A periodic contact pattern: foot f stands while frac(phase - offset_f) < duty_f.

    Attributes:
        name: for messages.
        period: length of a cycle, s, positive.
        duty: fraction of the cycle that each foot stands, [4], in 0 to 1; not all 0.
        offset: phase at which each foot touches down, [4], in cycles.
    """

    name: str
    period: float
    duty: tuple[float, float, float, float]
    offset: tuple[float, float, float, float]

    def __post_init__(self) -> None:
        checks.positive(f"gait {self.name}: period", self.period)
        checks.array(f"gait {self.name}: offset", self.offset, 4)
        duty = checks.array(f"gait {self.name}: duty", self.duty, 4)
        if not ((duty >= 0) & (duty <= 1)).all():
            raise ProblemError(
                f"gait {self.name}: duty is {duty.tolist()}; each must be from 0 to 1"
            )
        if not duty.any():
            raise ProblemError(f"gait {self.name}: duty is 0 for every foot; none would ever stand")

    def stands(self, phase: np.ndarray | float) -> np.ndarray:
        """Contact flags [..., 4] (bool) at phases in cycles."""
        phases = np.asarray(phase, dtype=float)
        return self.core.stands(phases.ravel()).reshape(*phases.shape, 4)

    @cached_property
    def core(self) -> _core.Gait:
        """As the engine has it."""
        return _core.Gait(self.name, self.period, tuple(self.duty), tuple(self.offset))

    @staticmethod
    def of(core: _core.Gait) -> Gait:
        """A gait of the engine."""
        duty, offset = ((a, b, c, d) for a, b, c, d in (core.duty, core.offset))
        return Gait(core.name, core.period, duty, offset)


def stand(period: float = 0.5) -> Gait:
    """All feet stand; the period only says when a change of gait may begin."""
    return Gait("stand", period, (1.0,) * 4, (0.0,) * 4)


def trot(period: float = 14 / 30, duty: float = 0.5) -> Gait:
    """Diagonal pairs LF+RH and RF+LH in turn."""
    return Gait("trot", period, (duty,) * 4, (0.0, 0.5, 0.5, 0.0))


def pace(period: float = 14 / 30, duty: float = 0.5) -> Gait:
    """Lateral pairs LF+LH and RF+RH in turn."""
    return Gait("pace", period, (duty,) * 4, (0.0, 0.5, 0.0, 0.5))


def bound(period: float = 14 / 30, duty: float = 0.5) -> Gait:
    """Front pair and hind pair in turn."""
    return Gait("bound", period, (duty,) * 4, (0.0, 0.0, 0.5, 0.5))


def pronk(period: float = 14 / 30, duty: float = 0.6) -> Gait:
    """All four feet together, with a flight phase in between."""
    return Gait("pronk", period, (duty,) * 4, (0.0,) * 4)


def crawl(period: float = 1.2, duty: float = 0.75) -> Gait:
    """One foot after the other swings: LH, LF, RH, RF (lateral sequence)."""
    # A foot touches down at its offset and lifts off (1 - duty) before.
    return Gait("crawl", period, (duty,) * 4, (0.25, 0.75, 0.0, 0.5))


GAITS = {f.__name__: f for f in (stand, trot, pace, bound, pronk, crawl)}


def by_name(name: str, **options: float) -> Gait:
    """The gait called `name` with its period or duty changed; raises ProblemError if unknown."""
    if name not in GAITS:
        raise ProblemError(f"gait {name!r} is unknown; there are {', '.join(GAITS)}")
    return GAITS[name](**options)


class GaitClock:
    """The gait of one robot over time, with changes under way.

    Contact is a function of time alone, so planners may sample it at any rate.

    Args:
        gait: gait at the start.
        time: when its first cycle begins, s.
        phase: phase at that time, in cycles.

    Example:
        >>> clock = GaitClock(stand())
        >>> clock.change(trot(), time=1.0)
        1.0
        >>> flags = clock.contacts(0.9 + np.arange(16) / 30)  # [16, 4]
    """

    def __init__(self, gait: Gait, time: float = 0.0, phase: float = 0.0) -> None:
        start = checks.finite("gait clock: time", time)
        self._core = _core.GaitClock(gait.core, start, checks.finite("gait clock: phase", phase))

    @staticmethod
    def of(core: _core.GaitClock) -> GaitClock:
        """A clock of the engine, such as a planner's."""
        clock = GaitClock.__new__(GaitClock)
        clock._core = core
        return clock

    def gait(self, time: float) -> Gait:
        """The gait at `time`; before the start, the first one."""
        return Gait.of(self._core.gait(time))

    def phase(self, time: float) -> float:
        """Phase in cycles, in [0, 1)."""
        return self._core.phase(time)

    def change(self, gait: Gait, time: float, at_once: bool = False) -> float:
        """Plans a change of gait at the first end of a cycle from `time` on; returns when that is.

        Changes planned for later are dropped. The new gait begins at phase 0. A standing robot
        has no cycle to end, so its change happens at `time`, as does any with `at_once`.
        """
        return self._core.change(gait.core, checks.finite("gait clock: time", time), at_once)

    def sense(self, foot: int, time: float, has_ground: bool) -> None:
        """Says whether a foot has the ground at `time`, s; not before what was said last.

        One that has it before it is due stands from now on, to the end of the stance that was to
        come; one that is due and does not have it is counted on 20 ms later.
        """
        if foot not in range(4):
            raise ProblemError(f"gait clock: foot is {foot}; it must be 0 to 3")
        self._core.sense(int(foot), checks.finite("gait clock: time", time), has_ground)

    def contacts(self, times: np.ndarray) -> np.ndarray:
        """Contact flags [n, 4] (bool) at `times` [n], s."""
        return self._core.contacts(np.asarray(times, dtype=float))

    def stances(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Begin and end, s, of the stance that holds at each of `times` [n] or comes next, [n, 4].

        The gait of that time is taken to go on: changes planned for later do not count.
        """
        return self._core.stances(np.asarray(times, dtype=float))
