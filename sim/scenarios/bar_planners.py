"""The planners of robots on bars, and what they are told of a team."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from palanquin.problems.layered.bar import Bar
from palanquin.problems.layered.centralized import CentralizedPlanner, NominalPlanner
from palanquin.problems.layered.distributed import DistributedPlanner
from palanquin.problems.layered.interconnected import COMPOSITE_INERTIA, Team
from palanquin.problems.layered.planner import Planner
from palanquin.problems.layered.settings import WORKING, LayeredSettings
from palanquin.problems.robots import A1
from palanquin.sim.scenarios.bar_team import ATTACH, BarTeam

KINDS: dict[str, Callable[..., Planner]] = {
    "centralized": CentralizedPlanner,
    "distributed": DistributedPlanner,
    "nominal": NominalPlanner,
}


PHYSICS = replace(
    WORKING,
    position=(3e5, 3e5, 3e6),
    velocity=(3e4, 3e4, 3e4),
    rotation=(1e6, 1e6, 1e6),
    normal=(0.0, 250.0),
)
"""The working weights with less on y (3e7 in V-A.3) and rotation (1e8), and more on velocity (1e4).

On two feet a robot pushes freely along the line between them only. What the printed weights spend
there to hold y and the last milliradian, they pay for in velocity: with 5 kg on the bar, flat
ground cost 0.05 m/s instead of 0.02, sinusoids of 40 N on each axis threw the robots over within
3 s, and those of 60 N still did with y alone corrected. A velocity weight of 1e5 is too much on
rough ground: 9 of 16 runs of `palanquin campaign bar --suite rough` fell. A leg gives no more than
250 N: a foot that lands is not asked for a blow.
"""


def build_planner(kind: str, team: BarTeam, friction: float, settings: LayeredSettings) -> Planner:
    """Plans for the robots and their bars alone: loads, forces and restricted joints are unknown
    to it. Lowers its problem, which takes some seconds the first time.

    Args:
        kind: one of `KINDS`.
        team: robots and bars.
        friction: coefficient that it counts on, instead of the settings'.
        settings: weights, horizon and rows.
    """
    return KINDS[kind](interconnected(team), replace(settings, friction=friction))


def interconnected(team: BarTeam, restrict: tuple[str, ...] = ()) -> Team:
    """The model of `team`: A1s as single rigid bodies, bars without mass, on joints that can't turn
    about the axes `restrict`.
    """
    bars = [
        Bar(robots=(i, i + 1), length=team.length, attach=(ATTACH, ATTACH), restrict=restrict)
        for i in range(team.robots - 1)
    ]
    return Team([A1.mass] * team.robots, [COMPOSITE_INERTIA] * team.robots, bars)
