"""Gaits: which foot stands when, and a clock that runs apart from any solver.

Feet are ordered LF, RF, LH, RH.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palanquin.errors import ProblemError
from palanquin.problems import checks

# Flags are sampled at t_k + _LATE cycles, so that an instant which rounding has put just before a
# touchdown or lift-off counts as after it.
_LATE = 1e-6


@dataclass(frozen=True)
class Gait:
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
        offset, duty, always = self._arrays
        since_touchdown = np.asarray(phase, dtype=float)[..., None] - offset
        return (since_touchdown - np.floor(since_touchdown) < duty) | always

    @cached_property
    def _arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Offsets, less what counts as after; duties; which feet always stand."""
        duty = np.array(self.duty)
        return np.array(self.offset) - _LATE, duty, duty == 1.0

    @cached_property
    def stance(self) -> np.ndarray:
        """How long each foot stands, s, [4]."""
        return self.period * np.array(self.duty)

    def stances(self, phase: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """When the stance that holds at `phase` [n] or comes next begins and ends, seconds from
        there, each [n, 4]. One that never ends is as long as a cycle, half of it past.
        """
        duty = np.array(self.duty)
        since = np.mod(np.asarray(phase)[:, None] + _LATE - np.array(self.offset), 1.0)
        begin = np.where(since < duty, -since, 1.0 - since)
        begin = np.where(duty == 1.0, -0.5, begin)
        return self.period * begin, self.period * (begin + duty)


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
        self._starts = [checks.finite("gait clock: time", time)]
        self._gaits = [gait]
        self._phases = [checks.finite("gait clock: phase", phase)]

    def gait(self, time: float) -> Gait:
        """The gait at `time`; before the start, the first one."""
        return self._gaits[self._segment(time)]

    def phase(self, time: float) -> float:
        """Phase in cycles, in [0, 1)."""
        i = self._segment(time)
        return (self._phases[i] + (time - self._starts[i]) / self._gaits[i].period) % 1.0

    def change(self, gait: Gait, time: float, at_once: bool = False) -> float:
        """Plans a change of gait at the first end of a cycle from `time` on; returns when that is.

        Changes planned for later are dropped. The new gait begins at phase 0. A standing robot
        has no cycle to end, so its change happens at `time`, as does any with `at_once`.
        """
        time = checks.finite("gait clock: time", time)
        keep = self._segment(time) + 1
        del self._starts[keep:], self._gaits[keep:], self._phases[keep:]
        stands = min(self._gaits[-1].duty) >= 1.0
        if not (at_once or stands):
            remaining = -self.phase(time) % 1.0
            # A cycle that ended a rounding error ago has ended now.
            time += (remaining if remaining < 1 - _LATE else 0.0) * self._gaits[-1].period
        if time <= self._starts[0]:
            self._starts, self._gaits, self._phases = [time], [gait], [0.0]
        else:
            self._starts.append(time)
            self._gaits.append(gait)
            self._phases.append(0.0)
        return time

    def contacts(self, times: np.ndarray) -> np.ndarray:
        """Contact flags [n, 4] (bool) at `times` [n], s."""
        times = np.asarray(times, dtype=float)
        flags = np.empty((len(times), 4), dtype=bool)
        for gait, at, phase in self._by_gait(times):
            flags[at] = gait.stands(phase)
        return flags

    def stances(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Begin and end, s, of the stance that holds at each of `times` [n] or comes next, [n, 4].

        The gait of that time is taken to go on: changes planned for later do not count.
        """
        times = np.asarray(times, dtype=float)
        begin, end = np.empty((len(times), 4)), np.empty((len(times), 4))
        for gait, at, phase in self._by_gait(times):
            begin[at], end[at] = (times[at, None] + part for part in gait.stances(phase))
        return begin, end

    def _by_gait(self, times: np.ndarray) -> Iterator[tuple[Gait, np.ndarray | slice, np.ndarray]]:
        """Each gait with the times [n] that belong to it, as an index, and the phases there."""
        if len(self._gaits) == 1:
            parts: list[tuple[int, np.ndarray | slice]] = [(0, slice(None))]
        else:
            segments = self._segments(times)
            parts = [(i, segments == i) for i in np.unique(segments)]
        for i, at in parts:
            gait = self._gaits[i]
            yield gait, at, self._phases[i] + (times[at] - self._starts[i]) / gait.period

    def _segment(self, time: float) -> int:
        return int(self._segments(np.array([time]))[0])

    def _segments(self, times: np.ndarray) -> np.ndarray:
        """Which gait, by index, each time [n] belongs to."""
        late = _LATE * self._gaits[-1].period
        return np.maximum(np.searchsorted(self._starts, times + late, side="right") - 1, 0)
