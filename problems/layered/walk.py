"""A closed loop of planner and reduced-order plant: gait, footholds, commands, falls (V-B.1)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from palanquin.problems import gaits
from palanquin.problems.layered.interconnected import Team
from palanquin.problems.layered.planner import Desired, LayeredPlan, Planner, RobotStates
from palanquin.problems.layered.plant import Payload, Plant

HEIGHT = 0.26  # of the standing robot's centre of mass, m
SWING_TIME = 0.2  # s
STANCE_WIDTH, STANCE_LENGTH = 0.13, 0.18  # half distances of the feet, m
_HIPS = np.array(
    [[STANCE_LENGTH, STANCE_WIDTH], [STANCE_LENGTH, -STANCE_WIDTH],
     [-STANCE_LENGTH, STANCE_WIDTH], [-STANCE_LENGTH, -STANCE_WIDTH]]
)  # fmt: skip
_RAIBERT = 0.1  # s, of the velocity error in a foothold
_LEASH = 0.05  # m, by which a desired position may run ahead of the robot in a direction

Pushes = Callable[[float], np.ndarray]


def no_push(time: float) -> np.ndarray:
    """No external force on anybody."""
    return np.zeros(3)


NOTHING = Payload()


@dataclass(frozen=True)
class Walk:
    """What is asked of a team.

    Attributes:
        duration: s.
        velocity: desired velocities, world, m/s, [M, 3] or [3] for all.
        payload: on every bar, unknown to the planner.
        pushes: external forces at the centres of mass over time, N, [M, 3] or [3] for all.
        start: seconds of trotting on the spot before velocity and pushes begin.
    """

    duration: float = 10.0
    velocity: tuple[float, ...] | np.ndarray = (0.3, 0.0, 0.0)
    payload: Payload = NOTHING
    pushes: Pushes = no_push
    start: float = 0.5


@dataclass(frozen=True)
class WalkLog:
    """What happened, sampled at the planner's rate.

    Attributes:
        times: s, [n].
        positions, velocities: of the robots, [n, M, 3].
        tilts: angle between the body's z axis and the vertical, rad, [n, M].
        estimates: each robot's multipliers, [n, M, rows].
        multipliers: the plant's, [n, rows].
        solve_ms: [n].
        length_error: largest of a bar, m.
        fell_at: s, or None.
        events: planning failures, (time, message).
        desired: commanded velocities, [M, 3].
    """

    times: np.ndarray
    positions: np.ndarray
    velocities: np.ndarray
    tilts: np.ndarray
    estimates: np.ndarray
    multipliers: np.ndarray
    solve_ms: np.ndarray
    length_error: float
    fell_at: float | None
    events: list[tuple[float, str]]
    desired: np.ndarray

    @property
    def survived(self) -> bool:
        """Whether nobody fell."""
        return self.fell_at is None


def standing(team: Team) -> RobotStates:
    """Robots side by side along y, as far apart as the first bar is long, at their height."""
    spacing = team.bars[0].length if team.bars else 1.0
    position = np.zeros((team.robots, 3))
    position[:, 1] = spacing * (0.5 * (team.robots - 1) - np.arange(team.robots))
    position[:, 2] = HEIGHT
    feet = np.zeros((team.robots, 4, 3))
    feet[:, :, :2] = position[:, None, :2] + _HIPS
    still = np.zeros((team.robots, 3))
    return RobotStates(position, still, np.tile(np.eye(3), (team.robots, 1, 1)), still, feet)


def run_walk(
    planner: Planner,
    walk: Walk,
    team: Team | None = None,
    watch: Callable[[LayeredPlan], None] | None = None,
) -> WalkLog:
    """Runs a walk until its end or a fall.

    Args:
        planner: any of the three.
        walk: what is asked.
        team: the plant's robots and bars, the planner's own unless told (the nominal planner's team
            has no bars).
        watch: called with every plan.
    """
    team = team or planner.team
    plant = Plant(team, tuple(walk.payload for _ in team.bars))
    dt, horizon = planner.settings.dt, planner.settings.horizon
    gait = gaits.trot(2 * SWING_TIME)
    state = standing(team)
    command = np.broadcast_to(np.asarray(walk.velocity, dtype=float), (team.robots, 3))
    wanted = state.position.copy()
    samples: list[tuple[np.ndarray, ...]] = []
    fell_at, error = None, 0.0
    before = gait.stands(0.0)
    for n in range(round(walk.duration / dt)):
        time = n * dt
        moving = time >= walk.start
        velocity = command if moving else np.zeros_like(command)
        flags = gait.stands((time + dt * np.arange(horizon + 1)) / gait.period)
        if (landed := flags[0] & ~before).any():
            state = replace(state, feet=_step(state, landed, velocity))
        before = flags[0]
        wanted[:, :2] = _leashed(wanted[:, :2] + dt * velocity[:, :2], state.position[:, :2])
        contacts = np.broadcast_to(flags[:, None], (horizon + 1, team.robots, 4))
        plan = planner.plan(time, state, contacts, Desired(wanted.copy(), velocity))
        if watch is not None:
            watch(plan)
        push = np.broadcast_to(walk.pushes(time) if moving else 0.0, (team.robots, 3))
        state = plant.advance(state, plan.forces, push, dt)
        samples.append((
            np.array(time), state.position, state.velocity,
            np.arccos(np.clip(state.rotation[:, 2, 2], -1, 1)),
            plan.estimates, plant.multipliers, np.array(plan.solve_ms),
        ))  # fmt: skip
        error = max(error, plant.constraint_error(state))
        if has_fallen(state):
            fell_at = time + dt
            break
    times, positions, velocities, tilts, estimates, multipliers, solve_ms = (
        np.array(column) for column in zip(*samples, strict=True)
    )
    return WalkLog(
        times=times,
        positions=positions,
        velocities=velocities,
        tilts=tilts,
        estimates=estimates,
        multipliers=multipliers,
        solve_ms=solve_ms,
        length_error=error,
        fell_at=fell_at,
        events=planner.events,
        desired=command,
    )


def has_fallen(state: RobotStates) -> bool:
    """A robot that tilts by more than 60 degrees, is too low or too high, or is not finite."""
    heights, upright = state.position[:, 2], state.rotation[:, 2, 2]
    stands = (upright > 0.5) & (heights > 0.1) & (heights < 2 * HEIGHT)
    return not bool(stands.all())


def _step(state: RobotStates, landed: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Feet [M, 4, 3] after Raibert's heuristic for those that land."""
    heading = state.rotation[:, :2, 0]
    yaw = np.arctan2(heading[:, 1], heading[:, 0])
    turn = np.stack([np.cos(yaw), -np.sin(yaw), np.sin(yaw), np.cos(yaw)], axis=-1)
    hips = np.einsum("iab,fb->ifa", turn.reshape(-1, 2, 2), _HIPS)
    moved = state.velocity[:, :2]
    offset = 0.5 * SWING_TIME * moved + _RAIBERT * (moved - velocity[:, :2])
    feet = state.feet.copy()
    target = (state.position[:, :2] + offset)[:, None] + hips
    feet[:, landed, :2] = target[:, landed]
    return feet


def _leashed(wanted: np.ndarray, actual: np.ndarray) -> np.ndarray:
    return actual + np.clip(wanted - actual, -_LEASH, _LEASH)
