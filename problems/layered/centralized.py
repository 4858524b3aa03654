"""The centralized planner (16), and the nominal one that knows of no bar."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from palanquin import _core
from palanquin.problems.layered.interconnected import Team, build_interconnected
from palanquin.problems.layered.linear_mpc import LinearMpc
from palanquin.problems.layered.planner import Desired, Planner, RobotStates
from palanquin.problems.layered.settings import WORKING, LayeredSettings


class CentralizedPlanner(Planner):
    """One QP over all robots and bars (16).

    Example:
        >>> planner = CentralizedPlanner(Team())
        >>> plan = planner.plan(0.0, states, contacts, Desired(states.position, velocity))
        >>> plan.forces  # [M, 4, 3], N
    """

    core: _core.CentralizedPlanner

    def __init__(
        self,
        team: Team | None = None,
        settings: LayeredSettings = WORKING,
        qp: str = "structured",
        **options: object,
    ) -> None:
        team = team or Team()
        self.mpc = mpc = LinearMpc(
            build_interconnected(team, settings.horizon, settings.dt), qp, **options
        )
        self.state_columns = np.array([mpc.state_columns(name) for name in team.names()])
        self.force_columns = np.array([mpc.force_columns(name) for name in team.names()])
        self.bar_columns = (
            mpc.columns(*(f"{name}.lambda" for name in team.bar_names()))
            if team.bars
            else np.zeros(0, dtype=int)
        )
        p = mpc.params
        for name in team.names():
            p[f"{name}.weight"] = settings.state_weight
            p[f"{name}.force_weight"] = settings.force
            p[f"{name}.friction"] = settings.friction
            p[f"{name}.normal"] = settings.normal
        for name in team.bar_names():
            p[f"{name}.weight"] = settings.multiplier
            p[f"{name}.slack"] = settings.slack
            p[f"{name}.hard"], p[f"{name}.penalty"] = settings.row_flags()
        super().__init__(team, settings, _core.CentralizedPlanner(team.core, settings.dt, mpc.core))

    @property
    def problems(self) -> list[LinearMpc]:
        """The one of the whole team."""
        return [self.mpc]

    def linearize_at(self, states: RobotStates, contacts: np.ndarray, desired: Desired) -> None:
        """Puts operating point, parameters and references into the MPC's arrays."""
        self.core.linearize_at(0.0, *self._arrays(states, contacts, desired))


class NominalPlanner(CentralizedPlanner):
    """A planner per robot that knows nothing of bars: (16) without lambda and (15)."""

    def __init__(self, team: Team | None = None, *arguments: Any, **options: Any) -> None:
        super().__init__(replace(team or Team(), bars=()), *arguments, **options)
