"""What a scenario is: who carries, on what ground, how they are told to walk, for how long."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from palanquin.problems import checks, clm, gaits
from palanquin.problems.clm.planner import Planner
from palanquin.problems.terrains import Flat, Terrain
from palanquin.sim.errors import InputError
from palanquin.sim.scenarios import lineup
from palanquin.sim.team import Team


@dataclass(frozen=True)
class Scenario:
    """A team side by side behind a beam, told a constant velocity on flat ground.

    Attributes:
        name: what `palanquin demo` calls it.
        summary: what one should see, in a sentence.
        velocity: command to the payload, in its heading frame.
        robots: how many Laikagos carry, 1 to 4.
        gait: name of the gait of all robots.
        horizon: number N of planned intervals.
        dt: their length, s.
        duration: of the whole run, s.
        trackings: how the plan can be followed: "kinematic", "physics".

    Change one with `dataclasses.replace`; a bad value raises InputError or ProblemError.
    """

    name: str
    summary: str
    velocity: clm.Velocity
    robots: int = 2
    gait: str = "trot"
    horizon: int = 15
    dt: float = 1 / 30
    duration: float = 10.0
    trackings: tuple[str, ...] = ("kinematic",)

    def __post_init__(self) -> None:
        lineup.check_size(self.robots)
        gaits.by_name(self.gait)
        if not 1 <= self.horizon <= 200:
            raise InputError(f"horizon: {self.horizon} must be from 1 to 200 intervals")
        checks.positive("dt", self.dt)
        checks.positive("duration", self.duration)
        if self.gait == "stand" and self.velocity != clm.Velocity():
            raise InputError(
                f"velocity: {self.velocity} must be 0 with the gait 'stand', whose feet never move"
            )

    @property
    def terrain(self) -> Terrain:
        """The ground."""
        return Flat()

    @property
    def scene(self) -> Team:
        """The team as it is drawn."""
        return lineup.scene_team(self.robots)

    def command(self, time: float) -> clm.Velocity:
        """The commanded velocity at `time`, s."""
        return self.velocity

    def planner(self, **options: Any) -> Planner:
        """A planner of the scenario; options are fields of `SqpSettings`.

        The rows of several feet that land at once take more inner iterations to settle than the
        engine's default: a crawl of two broke the friction cone by up to 72 N with 3, 6 N with 6.
        """
        options = {"subproblem": {"max_inner_iterations": 6}, **options}
        team = lineup.planning_team(self.robots, gaits.by_name(self.gait))
        problem = clm.build_clm(team, self.horizon, self.dt, self.terrain)
        return Planner(problem, self.terrain, **options)

    def check_tracking(self, tracking: str) -> None:
        """Raises InputError unless the plan can be followed that way."""
        if tracking not in self.trackings:
            raise InputError(
                f"tracking: '{tracking}' is not available for this scenario yet; "
                f"'{self.name}' has {', '.join(self.trackings)}"
            )
