"""The problem of the centralized planner (16), and, without bars, of the nominal one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from palanquin import _core
from palanquin.errors import ProblemError
from palanquin.problem import Problem
from palanquin.problems import checks
from palanquin.problems.layered.bar import Bar
from palanquin.problems.layered.coupling import CouplingModule
from palanquin.problems.layered.feet import FeetModule
from palanquin.problems.layered.robot import RobotModule

A1_MASS = 12.45  # kg
TRUNK_INERTIA = (0.017, 0.057, 0.065)  # kg m^2, the trunk's alone
COMPOSITE_INERTIA = (0.142, 0.388, 0.420)  # kg m^2, of the whole robot as it stands


@dataclass(frozen=True)
class Team:
    """M robots and the bars between them.

    Attributes:
        masses: kg, [M].
        inertias: principal moments about the body axes, kg m^2, [M][3].
        bars: any graph; none, and the robots know nothing of each other.
    """

    masses: Sequence[float] = (A1_MASS, A1_MASS)
    inertias: Sequence[Sequence[float]] = (COMPOSITE_INERTIA, COMPOSITE_INERTIA)
    bars: Sequence[Bar] = (Bar(),)

    def __post_init__(self) -> None:
        robots = len(self.masses)
        if robots < 1:
            raise ProblemError("team.masses is empty; at least one robot is needed")
        checks.positive_array("team.masses", self.masses, robots)
        checks.positive_array("team.inertias", self.inertias, robots, 3)
        for bar in self.bars:
            if max(bar.robots) >= robots:
                raise ProblemError(f"bar.robots is {bar.robots}; there are {robots} robots")

    @property
    def robots(self) -> int:
        """Number M of robots."""
        return len(self.masses)

    @property
    def core(self) -> _core.BarTeam:
        """As the engine takes it."""
        return _core.BarTeam(list(self.masses), [(bar.robots, bar.rows) for bar in self.bars])

    def names(self) -> list[str]:
        """Prefixes of the robots' blocks and parameters: robot1, robot2, ..."""
        return [f"robot{i + 1}" for i in range(self.robots)]

    def bar_names(self) -> list[str]:
        """Prefixes of the bars' blocks and parameters: bar1, bar2, ..."""
        return [f"bar{b + 1}" for b in range(len(self.bars))]


def build_interconnected(team: Team, horizon: int = 5, dt: float = 0.005) -> Problem:
    """The interconnected model (13)-(15) of a whole team.

    One linearisation about a trajectory that holds the operating point (x_t, u_{t-1}, lambda_{t-1})
    at every knot, and one QP: that is the linear MPC (16). Weights, masses, geometry, contact flags
    and friction are parameters; see the modules.
    """
    problem = Problem(horizon, dt, name=f"layered-{team.robots}-{len(team.bars)}")
    robots = problem.add(
        *(
            RobotModule(name, mass, inertia)
            for name, mass, inertia in zip(team.names(), team.masses, team.inertias, strict=True)
        )
    )
    robots = robots if isinstance(robots, list) else [robots]
    for robot in robots:
        problem.add(FeetModule(robot))
    coupled = []
    for name, bar in zip(team.bar_names(), team.bars, strict=True):
        module, ends = CouplingModule(name, bar), [robots[i] for i in bar.robots]
        coupling = problem.add(module)
        coupling.connect(ends)
        coupled.append((module, coupling, ends))
    for module, coupling, ends in coupled:
        module.state_rows(problem, coupling.rows(ends))
    return problem
