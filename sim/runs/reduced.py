"""The reduced-order model as the plant: single rigid bodies on bars, feet by a gait (V-B.1)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from palanquin.events import Event
from palanquin.problems import quaternions
from palanquin.problems.gaits import Gait, GaitClock
from palanquin.problems.layered import rotations
from palanquin.problems.layered.bar_planner import BarPlan
from palanquin.problems.layered.interconnected import Team
from palanquin.problems.layered.planner import RobotStates
from palanquin.problems.layered.plant import Payload, Plant
from palanquin.problems.layered.reference import STANDING_HEIGHT
from palanquin.problems.planning import Command, Measurement, Velocity
from palanquin.sim.scenarios.bar_forces import Force
from palanquin.sim.scenarios.bar_planners import interconnected
from palanquin.sim.scenarios.bars import BarScenario, start_pose
from palanquin.sim.scenarios.script import Orders

Array = NDArray[np.float64]

STANCE_WIDTH, STANCE_LENGTH = 0.13, 0.18  # half distances of the feet, m
_HIPS = np.array(
    [[STANCE_LENGTH, STANCE_WIDTH], [STANCE_LENGTH, -STANCE_WIDTH],
     [-STANCE_LENGTH, STANCE_WIDTH], [-STANCE_LENGTH, -STANCE_WIDTH]]
)  # fmt: skip
_RAIBERT = 0.1  # s, of the velocity error in a foothold
_STILL = Command((Velocity(),))


class ReducedPlant:
    """Robots as single rigid bodies that walk from the start, on massless legs and level ground; a
    foot lands where Raibert's heuristic has it.

    Args:
        scenario: team, load, gait, and forces from outside at the centres of mass.
    """

    def __init__(self, scenario: BarScenario) -> None:
        team, load = interconnected(scenario.team, scenario.team.restrict), scenario.team
        payload = Payload(load.payload, load.payload_at)
        self._plant = Plant(team, tuple(payload for _ in team.bars))
        self._clocks = [GaitClock(scenario.gait.gait) for _ in range(team.robots)]
        self._forces = [force for force in scenario.disturbances if isinstance(force, Force)]
        self._ticks, self._period = 0, 0.0
        self._state = standing(team, start_pose(scenario.seed))
        self._command: Command = _STILL
        self._stood = self.contacts(np.zeros(1))[0]
        self._plan: BarPlan | None = None
        self._push = np.zeros((team.robots, 3))
        self._length_error = 0.0

    @property
    def time(self) -> float:
        """Now, s."""
        return self._ticks * self._period

    @property
    def events(self) -> tuple[Event, ...]:
        """None: there is nothing that could break."""
        return ()

    @property
    def fall(self) -> str:
        """A robot that tilts by more than 60 degrees, is too low or too high, or is not finite."""
        heights, upright = self._state.position[:, 2], self._state.rotation[:, 2, 2]
        stands = (upright > 0.5) & (heights > 0.1) & (heights < 2 * STANDING_HEIGHT)
        fallen = np.flatnonzero(~stands)
        return f"robot {fallen[0] + 1} fell" if len(fallen) else ""

    def contacts(self, times: Array) -> NDArray[np.bool_]:
        """Which feet stand at `times` [n], s: [n, R, 4]."""
        return np.stack([clock.contacts(times) for clock in self._clocks], axis=1)

    def change_gait(self, robot: int, gait: Gait, time: float, at_once: bool = False) -> float:
        """Has a robot begin another gait, see `GaitClock.change`; returns when that is, s."""
        return self._clocks[robot].change(gait, time, at_once)

    def measure(self) -> Measurement:
        """The state itself, after feet that land now have their footholds."""
        flags = self.contacts(np.array([self.time]))[0]
        if (landed := flags & ~self._stood).any():
            self._state = replace(self._state, feet=self._footholds(landed))
        self._stood = flags
        state = self._state
        bodies = np.hstack([
            state.position, quaternions.from_rotation_vector(rotations.log(state.rotation)),
            state.velocity, state.angular_velocity,
        ])  # fmt: skip
        ground = np.zeros(len(state.position))
        return Measurement(self.time, bodies, state.feet, state.feet, ground)

    def apply(self, plan: BarPlan, seen: Measurement) -> Measurement:
        """The plan's forces act from now on."""
        self._plan = plan
        return seen

    def advance(self, period: float, orders: Orders) -> None:
        """By the plan's forces and those from outside."""
        if self._plan is None:
            raise RuntimeError("a plan must be applied before the bodies move")
        self._push = np.zeros_like(self._push)
        for force in self._forces:
            self._push[force.robot] += force.at(self.time)
        forces = self._plan.forces[0]
        self._state = self._plant.advance(self._state, forces, self._push, period)
        self._length_error = max(self._length_error, self._plant.constraint_error(self._state))
        self._command, self._period = orders, period
        self._ticks += 1

    def values(self) -> dict[str, Array]:
        """The bars' true multipliers and the pushes of the last period."""
        push = np.hstack([self._push, np.zeros_like(self._push)])
        return {"multipliers": self._plant.multipliers.copy(), "disturbance": push}

    def extremes(self) -> dict[str, float]:
        """How far a bar's length was off."""
        return {"bar_length_error_m": self._length_error}

    def _footholds(self, landed: NDArray[np.bool_]) -> Array:
        """Feet [M, 4, 3] after Raibert's heuristic for those that land now, [M, 4]."""
        state, robots = self._state, range(len(self._clocks))
        heading = state.rotation[:, :2, 0]
        yaw = np.arctan2(heading[:, 1], heading[:, 0])
        turn = np.stack([np.cos(yaw), -np.sin(yaw), np.sin(yaw), np.cos(yaw)], axis=-1)
        turn = turn.reshape(-1, 2, 2)
        told = np.array([(v.vx, v.vy) for v in (self._command.of(i) for i in robots)])
        wanted = np.einsum("iab,ib->ia", turn, told)
        begin, end = zip(*(c.stances(np.array([self.time])) for c in self._clocks), strict=True)
        half_stance = 0.5 * np.round(np.subtract(end, begin)[:, 0], 9)[..., None]  # [M, 4, 1]
        moved = state.velocity[:, None, :2]
        offset = half_stance * moved + _RAIBERT * (moved - wanted[:, None])
        target = state.position[:, None, :2] + offset + np.einsum("iab,fb->ifa", turn, _HIPS)
        feet = state.feet.copy()
        feet[landed, :2] = target[landed]
        return feet


def standing(team: Team, start: tuple[float, ...] | Array = (0.0, 0.0, 0.0)) -> RobotStates:
    """Robots side by side along y, as far apart as the first bar is long, at their height; the
    whole team turned and moved to `start` (x, y, yaw) [3], m and rad.
    """
    x, y, yaw = start
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1.0]])
    spacing = team.bars[0].length if team.bars else 1.0
    position = np.zeros((team.robots, 3))
    position[:, 1] = spacing * (0.5 * (team.robots - 1) - np.arange(team.robots))
    position[:, 2] = STANDING_HEIGHT
    feet = np.zeros((team.robots, 4, 3))
    feet[:, :, :2] = position[:, None, :2] + _HIPS
    still, shift = np.zeros((team.robots, 3)), np.array([x, y, 0.0])
    return RobotStates(
        position @ turn.T + shift, still, np.tile(turn, (team.robots, 1, 1)), still,
        feet @ turn.T + shift,
    )  # fmt: skip
