"""The reduced-order model as the plant: single rigid bodies on bars, feet by a gait (V-B.1)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from palanquin.problems import gaits, quaternions
from palanquin.problems.clm.references import Velocity
from palanquin.problems.layered import rotations
from palanquin.problems.layered.interconnected import Team
from palanquin.problems.layered.planner import Planner, RobotStates
from palanquin.problems.layered.plant import Payload, Plant
from palanquin.sim.runs.bar_planner import BarPlan, BarPlanner
from palanquin.sim.runs.bar_reference import within_square
from palanquin.sim.runs.loop import Measurement, run
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.teams import BarCarriers
from palanquin.sim.scenarios.bar_team import STANDING_HEIGHT
from palanquin.sim.scenarios.script import Orders

Array = NDArray[np.float64]

SWING_TIME = 0.2  # s
STANCE_WIDTH, STANCE_LENGTH = 0.13, 0.18  # half distances of the feet, m
_HIPS = np.array(
    [[STANCE_LENGTH, STANCE_WIDTH], [STANCE_LENGTH, -STANCE_WIDTH],
     [-STANCE_LENGTH, STANCE_WIDTH], [-STANCE_LENGTH, -STANCE_WIDTH]]
)  # fmt: skip
_RAIBERT = 0.1  # s, of the velocity error in a foothold
LEASH = within_square(0.05)

Pushes = Callable[[float], np.ndarray]


def no_push(time: float) -> np.ndarray:
    """No external force on anybody."""
    return np.zeros(3)


NOTHING = Payload()


@dataclass(frozen=True)
class Walk:
    """What is asked of a team, and what befalls it.

    Attributes:
        duration: s.
        velocity: commands of all robots [3] or of each [M, 3], (vx, vy, wz) in their headings, m/s
            and rad/s.
        payload: on every bar, unknown to the planner.
        pushes: external forces at the centres of mass over time, N, [M, 3] or [3] for all.
        start: seconds of trotting on the spot before velocity and pushes begin.
    """

    duration: float = 10.0
    velocity: tuple[float, ...] | np.ndarray = (0.3, 0.0, 0.0)
    payload: Payload = NOTHING
    pushes: Pushes = no_push
    start: float = 0.5

    def at(self, time: float, pose: Array, period: float) -> Orders:
        """As of `Director`."""
        rows = np.atleast_2d(np.asarray(self.velocity, dtype=float))
        share = float(time >= self.start)
        return Orders(velocities=tuple(Velocity(*(share * row).tolist()) for row in rows))


class ReducedPlant:
    """Robots as single rigid bodies that trot; a foot lands where Raibert's heuristic has it.

    Args:
        team: robots and bars.
        walk: what befalls it; of its commands the heuristic knows.
    """

    def __init__(self, team: Team, walk: Walk) -> None:
        self._plant = Plant(team, tuple(walk.payload for _ in team.bars))
        self._walk, self._gait = walk, gaits.trot(2 * SWING_TIME)
        self._ticks, self._period = 0, 0.0
        self._state = standing(team)
        self._stood = self._gait.stands(0.0)
        self._plan: BarPlan | None = None
        self._push = np.zeros((team.robots, 3))
        self._length_error = 0.0

    @property
    def time(self) -> float:
        """Now, s."""
        return self._ticks * self._period

    @property
    def fall(self) -> str:
        """A robot that tilts by more than 60 degrees, is too low or too high, or is not finite."""
        heights, upright = self._state.position[:, 2], self._state.rotation[:, 2, 2]
        stands = (upright > 0.5) & (heights > 0.1) & (heights < 2 * STANDING_HEIGHT)
        fallen = np.flatnonzero(~stands)
        return f"robot {fallen[0] + 1} fell" if len(fallen) else ""

    def contacts(self, times: Array) -> NDArray[np.bool_]:
        """Which feet stand at `times` [n], s: [n, R, 4]."""
        flags = self._gait.stands(times / self._gait.period)
        robots = len(self._state.position)
        return np.broadcast_to(flags[:, None], (len(times), robots, 4))

    def measure(self) -> Measurement:
        """The state itself, after feet that land now have their footholds."""
        flags = self._gait.stands(self.time / self._gait.period)
        if (landed := flags & ~self._stood).any():
            orders = self._walk.at(self.time, np.zeros(3), self._period)
            commands = [orders.of(i) for i in range(len(self._state.position))]
            velocity = np.array([(c.vx, c.vy) for c in commands])
            self._state = replace(self._state, feet=_step(self._state, landed, velocity))
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
        """By the plan's forces and the walk's pushes."""
        if self._plan is None:
            raise RuntimeError("a plan must be applied before the bodies move")
        moving = self.time >= self._walk.start
        self._push = np.broadcast_to(
            self._walk.pushes(self.time) if moving else 0.0, self._push.shape
        )
        forces = self._plan.plan.forces
        self._state = self._plant.advance(self._state, forces, self._push, period)
        self._length_error = max(self._length_error, self._plant.constraint_error(self._state))
        self._period = period
        self._ticks += 1

    def values(self) -> dict[str, Array]:
        """The bars' true multipliers and the pushes of the last period."""
        push = np.hstack([self._push, np.zeros_like(self._push)])
        return {"multipliers": self._plant.multipliers.copy(), "disturbance": push}

    def extremes(self) -> dict[str, float]:
        """How far a bar's length was off."""
        return {"bar_length_error_m": self._length_error}


def run_walk(
    planner: Planner,
    walk: Walk,
    team: Team | None = None,
    progress: Callable[[int], None] = lambda ticks: None,
) -> Record:
    """Runs a walk until its end or a fall.

    Args:
        planner: any of the layered ones, not used before.
        walk: what is asked.
        team: the plant's robots and bars, the planner's own unless told (the nominal planner's team
            has no bars).
        progress: called after every plan with the number of ticks done.
    """
    team = team or planner.team
    plant, leading = reduced(planner, walk, team)
    carriers = BarCarriers(tuple(f"robot{i + 1}" for i in range(team.robots)))
    period = planner.settings.dt
    return run(
        plant, leading, walk, carriers, round(walk.duration / period), period, progress=progress
    )


def reduced(
    planner: Planner, walk: Walk, team: Team | None = None
) -> tuple[ReducedPlant, BarPlanner]:
    """The walk's plant, and the planner, as the loop takes them."""
    plant = ReducedPlant(team or planner.team, walk)
    return plant, BarPlanner(planner, plant.contacts, LEASH)


def standing(team: Team) -> RobotStates:
    """Robots side by side along y, as far apart as the first bar is long, at their height."""
    spacing = team.bars[0].length if team.bars else 1.0
    position = np.zeros((team.robots, 3))
    position[:, 1] = spacing * (0.5 * (team.robots - 1) - np.arange(team.robots))
    position[:, 2] = STANDING_HEIGHT
    feet = np.zeros((team.robots, 4, 3))
    feet[:, :, :2] = position[:, None, :2] + _HIPS
    still = np.zeros((team.robots, 3))
    return RobotStates(position, still, np.tile(np.eye(3), (team.robots, 1, 1)), still, feet)


def _step(state: RobotStates, landed: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Feet [M, 4, 3] after Raibert's heuristic for those that land; commands [M, 2] in headings."""
    heading = state.rotation[:, :2, 0]
    yaw = np.arctan2(heading[:, 1], heading[:, 0])
    turn = np.stack([np.cos(yaw), -np.sin(yaw), np.sin(yaw), np.cos(yaw)], axis=-1)
    turn = turn.reshape(-1, 2, 2)
    hips = np.einsum("iab,fb->ifa", turn, _HIPS)
    wanted = np.einsum("iab,ib->ia", turn, velocity)
    moved = state.velocity[:, :2]
    offset = 0.5 * SWING_TIME * moved + _RAIBERT * (moved - wanted)
    feet = state.feet.copy()
    target = (state.position[:, :2] + offset)[:, None] + hips
    feet[:, landed, :2] = target[:, landed]
    return feet
