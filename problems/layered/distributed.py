"""The distributed planners (23): one QP per robot, over links with a delay."""

from __future__ import annotations

from collections.abc import Mapping

from palanquin import _core
from palanquin.errors import ProblemError
from palanquin.problems.layered.interconnected import Team
from palanquin.problems.layered.linear_mpc import LinearMpc
from palanquin.problems.layered.link import LinkSettings
from palanquin.problems.layered.local import build_local, neighbours, own_bars
from palanquin.problems.layered.planner import Planner
from palanquin.problems.layered.settings import WORKING, LayeredSettings


class DistributedPlanner(Planner):
    """Local planners that exchange their solutions (Assumption 2). Of its neighbours each knows
    what they sent, and their gait.

    Args:
        team: robots and bars, each robot with at least one bar.
        settings: see `LayeredSettings`; `exchanges` of them are made per sample.
        links: settings by (sender, receiver); a plain one-sample delay unless told.
    """

    core: _core.DistributedPlanner

    def __init__(
        self,
        team: Team | None = None,
        settings: LayeredSettings = WORKING,
        qp: str = "structured",
        links: Mapping[tuple[int, int], LinkSettings] | None = None,
        **options: object,
    ) -> None:
        team = team or Team()
        robots = range(team.robots)
        joined = {(j, i) for i in robots for j in neighbours(team, i)}
        if unknown := sorted(set(links or {}) - joined):
            raise ProblemError(f"links has {unknown}; bars join {sorted(joined)}")
        self._problems = [_local_mpc(team, i, settings, qp, **options) for i in robots]
        core = _core.DistributedPlanner(
            team.core,
            settings.dt,
            settings.dual_terms,
            settings.exchanges,
            [mpc.core for mpc in self._problems],
            {ends: link.core for ends, link in (links or {}).items()},
        )
        super().__init__(team, settings, core)

    @property
    def problems(self) -> list[LinearMpc]:
        """Those of the robots."""
        return self._problems

    @property
    def local_ms(self) -> list[float]:
        """What each robot's part of the last plan took, ms."""
        return self.core.local_ms


def _local_mpc(
    team: Team, robot: int, settings: LayeredSettings, qp: str, **options: object
) -> LinearMpc:
    """The problem of one robot's planner, with what stays the same from sample to sample."""
    names = team.names()
    mpc = LinearMpc(build_local(team, robot, settings.horizon, settings.dt), qp, **options)
    own, p = names[robot], mpc.params
    p[f"{own}.weight"] = settings.state_weight
    p[f"{own}.force_weight"] = settings.force
    p[f"{own}.friction"] = settings.friction
    p[f"{own}.normal"] = settings.normal
    for j in neighbours(team, robot):
        p[f"{names[j]}.mass"] = team.masses[j]
        p[f"{names[j]}.inertia"] = team.inertias[j]
    for name in (team.bar_names()[b] for b in own_bars(team, robot)):
        p[f"{name}.weight"] = settings.multiplier
        p[f"{name}.agreement"] = settings.agreement
        p[f"{name}.slack"] = settings.slack
        p[f"{name}.hard"], p[f"{name}.penalty"] = settings.row_flags()
    return mpc
