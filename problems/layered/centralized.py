"""The centralized planner (16), and the nominal one that knows of no bar."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from palanquin import _core
from palanquin.problems.layered.interconnected import Team, build_interconnected
from palanquin.problems.layered.linear_mpc import LinearMpc
from palanquin.problems.layered.planner import Desired, LayeredPlan, Planner, RobotStates
from palanquin.problems.layered.settings import WORKING, LayeredSettings


class CentralizedPlanner(Planner):
    """One QP over all robots and bars (16).

    Example:
        >>> planner = CentralizedPlanner(Team())
        >>> plan = planner.plan(0.0, states, contacts, Desired(states.position, velocity))
        >>> plan.forces  # [M, 4, 3], N
    """

    def __init__(
        self,
        team: Team | None = None,
        settings: LayeredSettings = WORKING,
        qp: str = "structured",
        **options: object,
    ) -> None:
        super().__init__(team, settings)
        team = self.team
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
        self._views = [
            tuple(p[f"{name}.{part}"] for part in ("rotation", "feet", "contact", "desired"))
            for name in team.names()
        ]

    @property
    def problems(self) -> list[LinearMpc]:
        """The one of the whole team."""
        return [self.mpc]

    def _solve(
        self, time: float, states: RobotStates, contacts: np.ndarray, desired: Desired
    ) -> LayeredPlan:
        self.linearize_at(states, contacts, desired)
        status = self.mpc.solve()
        z = self.mpc.trajectory
        n = self.settings.horizon
        bars = z[:n, self.bar_columns]
        return LayeredPlan(
            time,
            self.settings.dt,
            z[:, self.state_columns],
            states.rotation,
            z[:n, self.force_columns],
            bars,
            np.broadcast_to(bars[0], (self.team.robots, bars.shape[1])),
            status.name.lower(),
            usable := _core.is_usable(status),
            "" if usable else self.mpc.message,
            cost=(self.mpc.cost,),
        )

    def linearize_at(self, states: RobotStates, contacts: np.ndarray, desired: Desired) -> None:
        """Puts operating point, parameters and references into the MPC's arrays."""
        guess = self.mpc.guess
        x = np.zeros((self.team.robots, 12))
        x[:, 0:3], x[:, 3:6], x[:, 9:12] = (
            states.position, states.velocity, states.angular_velocity,
        )  # fmt: skip
        guess[:, self.state_columns] = x
        guess[:-1, self.force_columns] = self.operating_inputs(contacts)
        guess[:, self.bar_columns] = self.operating_multipliers()
        wanted = desired.over_horizon(states.rotation, self.settings.horizon, self.settings.dt)
        for i, (rotation, feet, contact, reference) in enumerate(self._views):
            rotation[:] = states.rotation[i]
            feet[:] = states.feet[i]
            contact[:] = contacts[:, i]
            reference[:] = wanted[i]


class NominalPlanner(CentralizedPlanner):
    """A planner per robot that knows nothing of bars: (16) without lambda and (15)."""

    def __init__(self, team: Team | None = None, *arguments: Any, **options: Any) -> None:
        super().__init__(replace(team or Team(), bars=()), *arguments, **options)
