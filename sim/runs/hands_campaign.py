"""Campaigns of a payload in hands in full physics: random pushes, and masses that nobody told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from palanquin.sim.errors import InputError
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import Scenario, open_scenario
from palanquin.sim.scenarios.lineup import with_robots
from palanquin.sim.scenarios.physical import physical

PUSH_START, PUSH_DURATION, RECOVERY = 1.4, 0.8, 1.4
"""The earliest push, how long it is, and the run after it, s."""

SETTLED = 1.0
"""From here on heights count, s."""

BACKWARDS = 120.0
"""A push has a backward part from this angle to the heading on, degrees."""

REMEDIES = ("leg_torque", "arm_torque", "observers")
"""Planner settings that a campaign can do without."""

_GAIT_CYCLE = 0.5  # s: within which the instant of a push is drawn
_SLOPE = float(np.tan(np.radians(22.0)))


def pushed(scenario: Scenario, force: float, seed: int) -> Scenario:
    """With one robot pushed by so many N, who, whither and when as the seed has it."""
    random = np.random.default_rng(seed)
    robot = scenario.names[random.integers(len(scenario.names))]
    angle, start = random.uniform(-np.pi, np.pi), PUSH_START + _GAIT_CYCLE * random.uniform()
    push = {
        "body": robot,
        "force": [force * np.cos(angle), force * np.sin(angle), 0.0],
        "start": start,
        "duration": PUSH_DURATION,
    }
    return scenario.changed(pushes=[push], duration=start + PUSH_DURATION + RECOVERY)


def weighing(scenario: Scenario, mass: float, seed: int) -> Scenario:
    """With a payload of so many kg that the planner does not know of."""
    return scenario.changed(world={"payload_mass": mass}, duration=4.0)


def heavier(scenario: Scenario, share: float, seed: int) -> Scenario:
    """With robots of this share of the masses that planner and controllers know."""
    return scenario.changed(world={"robot_mass": share}, duration=4.0)


@dataclass(frozen=True)
class Suite:
    """A shipped scenario, what a seed and a value make of it, and changes of its fields."""

    scenario: str
    draw: Callable[[Scenario, float, int], Scenario]
    meaning: str
    changes: dict[str, Any]
    gait: str = "trot"
    robots: int = 2


def _velocity(vx: float) -> dict[str, Any]:
    return {"command": {"type": "velocity", "steps": [{"vx": vx}]}}


_ON_SLOPE = {**_velocity(0.2), "terrain": {"type": "plane", "z0": 0.0, "ax": _SLOPE, "ay": 0.0}}

SUITES = {
    "push-stand": Suite("trot", pushed, "pushes of N while standing", _velocity(0.0), "stand"),
    "push-trot": Suite("trot", pushed, "pushes of N at 0.4 m/s", {}),
    "push-three": Suite("trot", pushed, "the same, three robots", {}, robots=3),
    "push-slope": Suite("trot", pushed, "pushes of N at 0.2 m/s, up 22 degrees", _ON_SLOPE),
    "payload": Suite("trot", weighing, "payloads of kg, the planner is told 16", {}),
    "robots": Suite("trot", heavier, "robots of a share of the masses that all are told", {}),
}


@dataclass(frozen=True)
class HandsTrial:
    """One run: a suite at a value, without some of the `REMEDIES`, at a gait's period (s, 0: its
    own), with a seed.
    """

    suite: str
    value: float
    without: tuple[str, ...]
    period: float
    seed: int

    @property
    def key(self) -> str:
        """Under which its figures are kept."""
        settings = ",".join(self.without) or "all"
        return f"{self.suite} {self.value:g} {settings} {self.period:g} {self.seed}"

    def scenario(self) -> Scenario:
        """What to run; every trial but that of seed 0 starts a little off."""
        suite = SUITES[self.suite]
        plain = with_robots(open_scenario(suite.scenario), suite.robots)
        gait = {"name": suite.gait} | ({"period": self.period} if self.period else {})
        robots = tuple(robot.changed(gait=gait) for robot in plain.robots)
        planner = {name: getattr(plain.planner, name) for name in plain.planner.model_fields_set}
        planner |= dict.fromkeys(self.without)
        told = plain.changed(robots=robots, planner=planner, seed=self.seed, **suite.changes)
        return physical(suite.draw(told, self.value, self.seed))

    def run(self) -> dict[str, Any]:
        """Its figures, with the trial itself; see `figures_of`."""
        scenario = self.scenario()
        trial = {"suite": self.suite, "value": self.value, "without": list(self.without)}
        trial |= {"period": self.period, "seed": self.seed}
        return trial | figures_of(scenario, run_scenario(scenario))


def figures_of(scenario: Scenario, record: Record) -> dict[str, Any]:
    """Of a run: "payload_max_m" and "payload_end_m", its distance from the reference, the largest
    one from the push (or 1 s) on and the mean of the last 0.2 s; "height_max_m", the largest error
    of its height after 1 s; "angle_deg" of the push to the heading, 180 is backwards; "mass_kg" as
    the observer has it.
    """
    figures = outcome(record)
    error = (record.bodies - record.references)[:, 0, :3]
    away = np.linalg.norm(error, axis=1)
    push = next(iter(scenario.pushes), None)
    counts = record.time >= min(push.start if push else SETTLED, record.time[-1])
    settled = record.time >= min(SETTLED, record.time[-1])
    return {
        "completed": figures["completed"],
        "fall": record.fall,
        "robot": push.body if push else "",
        "angle_deg": float(np.degrees(np.arctan2(push.force[1], push.force[0]))) if push else 0.0,
        "payload_max_m": float(away[counts].max()),
        "payload_end_m": float(away[record.time >= record.time[-1] - 0.2].mean()),
        "height_max_m": float(np.abs(error[settled, 2]).max()),
        "saturated_share": figures["saturated_share"],
        "mass_kg": figures["apparent_payload_mass_kg"],
    }


def hands_trials(
    suite: str, values: tuple[float, ...], without: tuple[str, ...], period: float, seeds: int
) -> list[HandsTrial]:
    """Seeds 1 to `seeds` of a suite at each value; raises InputError for unknown names."""
    if suite not in SUITES:
        raise InputError(f"suite: {suite!r} is not one of {', '.join(SUITES)}")
    for name in without:
        if name not in REMEDIES:
            raise InputError(f"without: {name!r} is not one of {', '.join(REMEDIES)}")
    if not 1 <= seeds <= 10_000:
        raise InputError(f"seeds: {seeds} must be from 1 to 10000")
    if not all(value > 0 for value in values) or not period >= 0:
        raise InputError(f"at: {list(values)} must be positive, and period {period} not negative")
    return [HandsTrial(suite, v, without, period, s) for v in values for s in range(1, seeds + 1)]


def hands_summary(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """For each suite, value and setting: successes, and the worst of those who did not fall."""
    groups: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
    for row in rows:
        key = (row["suite"], row["value"], tuple(row["without"]), row["period"])
        groups.setdefault(key, []).append(row)
    return [_summary_of(key, group) for key, group in sorted(groups.items())]


def _summary_of(key: tuple[Any, ...], group: list[dict[str, Any]]) -> dict[str, Any]:
    backwards = [abs(row["angle_deg"]) >= BACKWARDS for row in group]
    stood = [row["completed"] for row in group]
    away = np.array([row["payload_max_m"] for row in group])
    others = [a for a, s, back in zip(away, stood, backwards, strict=True) if s and not back]
    back = [a for a, s, back in zip(away, stood, backwards, strict=True) if s and back]
    end = [row["payload_end_m"] for row in group if row["completed"]]
    height = [row["height_max_m"] for row in group if row["completed"]]
    return {
        "suite": key[0],
        "value": key[1],
        "without": ",".join(key[2]),
        "period": key[3],
        "trials": len(group),
        "completed": sum(stood),
        "backwards": f"{len(back)} of {sum(backwards)}",
        "payload_max_m": max(others, default=float("nan")),
        "payload_max_backwards_m": max(back, default=float("nan")),
        "payload_end_m": max(end, default=float("nan")),
        "height_max_m": max(height, default=float("nan")),
        "saturated_share": float(np.mean([row["saturated_share"] for row in group])),
        "falls": [row["fall"] for row in group if row["fall"]],
    }
