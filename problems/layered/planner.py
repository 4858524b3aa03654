"""What the three planners have in common: states in, plans out."""

from __future__ import annotations

import time as clock
from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace

import numpy as np

from palanquin.errors import ProblemError
from palanquin.events import Event, EventKind
from palanquin.problems import checks
from palanquin.problems.layered import rotations
from palanquin.problems.layered.interconnected import Team
from palanquin.problems.layered.linear_mpc import LinearMpc
from palanquin.problems.layered.settings import WORKING, LayeredSettings
from palanquin.problems.modules.rigid_body import GRAVITY


@dataclass(frozen=True)
class RobotStates:
    """What is measured of M robots.

    Attributes:
        position: centres of mass in the world, m, [M, 3].
        velocity: in the world, m/s, [M, 3].
        rotation: body to world, [M, 3, 3].
        angular_velocity: body axes, rad/s, [M, 3].
        feet: LF, RF, LH, RH in the world, m, [M, 4, 3]; of a foot in the air, where it will stand.
    """

    position: np.ndarray
    velocity: np.ndarray
    rotation: np.ndarray
    angular_velocity: np.ndarray
    feet: np.ndarray


@dataclass(frozen=True)
class Desired:
    """Where the robots should be now; over the horizon they move on with the given velocities.

    Attributes:
        position: m, [M, 3].
        velocity: world, m/s, [M, 3].
        rotation: body to world, [M, 3, 3]; upright and facing x unless given.
        angular_velocity: body axes, rad/s, [M, 3]; zero unless given.
    """

    position: np.ndarray
    velocity: np.ndarray
    rotation: np.ndarray | None = None
    angular_velocity: np.ndarray | None = None

    def over_horizon(self, operating: np.ndarray, horizon: int, dt: float) -> np.ndarray:
        """Desired (r, v, xi, w) with xi about the rotations `operating`, [M, N + 1, 12]."""
        robots = len(self.position)
        times = dt * np.arange(horizon + 1)[:, None]
        x = np.zeros((robots, horizon + 1, 12))
        x[:, :, 0:3] = self.position[:, None] + times * self.velocity[:, None]
        x[:, :, 3:6] = self.velocity[:, None]
        back = np.swapaxes(operating, -1, -2)
        if self.angular_velocity is None:
            wanted = back if self.rotation is None else back @ self.rotation
            x[:, :, 6:9] = rotations.log(wanted)[:, None]
            return x
        start = np.tile(np.eye(3), (robots, 1, 1)) if self.rotation is None else self.rotation
        turned = start[:, None] @ rotations.exp(times * self.angular_velocity[:, None])
        x[:, :, 6:9] = rotations.log(back[:, None] @ turned)
        x[:, :, 9:12] = self.angular_velocity[:, None]
        return x


@dataclass(frozen=True)
class LayeredPlan:
    """A plan of one sample, for the whole-body layer: the next knot and the forces until then.

    Attributes:
        time: when it was made, s.
        dt: length of an interval, s.
        states: planned (r, v, xi, w) at all knots, xi about `operating`, [N + 1, M, 12].
        operating: rotations R_op, [M, 3, 3].
        inputs: ground reaction forces in the world, N, [N, M, 4, 3].
        bars: multipliers [N, rows of all bars]; for a free bar N/m.
        estimates: each robot's own estimate of them at the first knot, [M, rows]; rows of bars that
            a robot has no part in are NaN.
        status: why the solver stopped.
        is_usable: whether this is a solution; if not, it is the last one, shifted.
        event: what went wrong, in words; empty unless something did.
        solve_ms: wall time from the states to this plan, all robots' QPs one after the other.
        cost: optimal costs, constants included: one, or one per robot.
    """

    time: float
    dt: float
    states: np.ndarray = field(repr=False)
    operating: np.ndarray = field(repr=False)
    inputs: np.ndarray = field(repr=False)
    bars: np.ndarray = field(repr=False)
    estimates: np.ndarray = field(repr=False)
    status: str = ""
    is_usable: bool = True
    event: str = ""
    solve_ms: float = 0.0
    cost: tuple[float, ...] = ()

    @property
    def position(self) -> np.ndarray:
        """Desired centres of mass at the next knot, m, [M, 3]."""
        return self.states[1, :, 0:3]

    @property
    def velocity(self) -> np.ndarray:
        """Desired velocities at the next knot, m/s, [M, 3]."""
        return self.states[1, :, 3:6]

    @property
    def rotation(self) -> np.ndarray:
        """Desired rotations at the next knot, body to world, [M, 3, 3]."""
        return self.operating @ rotations.exp(self.states[1, :, 6:9])

    @property
    def angular_velocity(self) -> np.ndarray:
        """Desired angular velocities at the next knot, body axes, rad/s, [M, 3]."""
        return self.states[1, :, 9:12]

    @property
    def forces(self) -> np.ndarray:
        """Ground reaction forces until the next knot, world, N, [M, 4, 3]; zero in swing."""
        return self.inputs[0]

    @property
    def multipliers(self) -> np.ndarray:
        """The bars' multipliers until the next knot, [rows]."""
        return self.bars[0]

    def shifted(self, elapsed: float) -> LayeredPlan:
        """The plan as it stands `elapsed` seconds later; its end is held."""
        steps = min(round(elapsed / self.dt), len(self.inputs))
        knots = np.minimum(np.arange(len(self.states)) + steps, len(self.states) - 1)
        intervals = np.minimum(knots[:-1], len(self.inputs) - 1)
        return replace(
            self,
            time=self.time + elapsed,
            states=self.states[knots],
            inputs=self.inputs[intervals],
            bars=self.bars[intervals],
        )


class Planner(ABC):
    """A linear MPC for the robots of a team; call `plan` at every sample.

    Args:
        team: robots and bars.
        settings: see `LayeredSettings`; `WORKING` and `PRINTED` are the named variants.
    """

    def __init__(self, team: Team | None = None, settings: LayeredSettings = WORKING) -> None:
        self.team = team or Team()
        self.settings = settings
        self.events: list[Event] = []
        self._last: LayeredPlan | None = None
        self._given: tuple[np.ndarray, np.ndarray] | None = None
        self._loads = -GRAVITY[2] * np.asarray(self.team.masses, dtype=float)

    def plan(
        self, time: float, states: RobotStates, contacts: np.ndarray, desired: Desired
    ) -> LayeredPlan:
        """Plans one sample.

        Args:
            time: s; must not go back.
            states: measured.
            contacts: flags of the feet at the knots, [N + 1, M, 4]; the last row is not looked at.
            desired: see `Desired`.

        Returns:
            The plan. Where the solver finds none it is the last one, shifted, or, without a last
            one, standing still with each stance leg's share of the weight; `event` says so.

        Raises:
            ProblemError: an array has the wrong shape or holds a number that is not finite.
        """
        start = clock.perf_counter()
        flags = self._checked(time, states, contacts, desired)
        plan = self._solve(time, states, flags, desired)
        if not plan.is_usable:
            plan = self._fallback(time, states, flags, plan)
        plan = replace(plan, solve_ms=1e3 * (clock.perf_counter() - start))
        self._last, self._given = plan, None
        return plan

    @property
    @abstractmethod
    def problems(self) -> list[LinearMpc]:
        """The problems that a plan solves, as the last one left them."""

    @abstractmethod
    def _solve(
        self, time: float, states: RobotStates, contacts: np.ndarray, desired: Desired
    ) -> LayeredPlan:
        """Solves; a plan that is not usable needs only status and event."""

    def _checked(
        self, time: float, states: RobotStates, contacts: np.ndarray, desired: Desired
    ) -> np.ndarray:
        robots = self.team.robots
        if not np.isfinite(time) or (self._last is not None and time < self._last.time):
            raise ProblemError(f"time is {time} s; it must be finite and must not go back")
        total = 0.0
        for name, value, shape in (
            ("states.position", states.position, (robots, 3)),
            ("states.velocity", states.velocity, (robots, 3)),
            ("states.rotation", states.rotation, (robots, 3, 3)),
            ("states.angular_velocity", states.angular_velocity, (robots, 3)),
            ("states.feet", states.feet, (robots, 4, 3)),
            ("desired.position", desired.position, (robots, 3)),
            ("desired.velocity", desired.velocity, (robots, 3)),
        ):
            if getattr(value, "shape", None) != shape:
                checks.array(name, value, *shape)
            total += float(value.sum())
        if not np.isfinite(total):  # which array it is matters only then
            for name in ("position", "velocity", "rotation", "angular_velocity", "feet"):
                checks.array(f"states.{name}", getattr(states, name), *getattr(states, name).shape)
            for name in ("position", "velocity"):
                checks.array(f"desired.{name}", getattr(desired, name), robots, 3)
        flags = np.asarray(contacts, dtype=bool)
        knots = self.settings.horizon + 1
        if flags.shape != (knots, robots, 4):
            raise ProblemError(
                f"contacts has shape {flags.shape}; ({knots}, {robots}, 4) is needed"
            )
        return flags

    def shares(self, contacts: np.ndarray) -> np.ndarray:
        """Vertical forces [..., M, 4, 3] that share each robot's weight among its stance legs."""
        forces = np.zeros((*contacts.shape, 3))
        standing = np.maximum(contacts.sum(axis=-1), 1)
        forces[..., 2] = contacts * (self._loads / standing)[..., None]
        return forces

    def operate_at(self, inputs: np.ndarray, multipliers: np.ndarray) -> None:
        """Sets u_{t-1} [M, 4, 3] and lambda_{t-1} [rows] of the next plan, as they are."""
        self._given = (inputs, multipliers)

    def operating_multipliers(self) -> np.ndarray:
        """lambda_{t-1} [rows of this planner's bars]."""
        rows = sum(bar.rows for bar in self.team.bars)
        if self._given is not None:
            return self._given[1][:rows]
        return np.zeros(rows) if self._last is None else self._last.multipliers

    def operating_inputs(self, contacts: np.ndarray) -> np.ndarray:
        """u_{t-1} at the knots [N, M, 4, 3]; a leg that stood not then starts with its share."""
        if self._given is not None:
            return self._given[0] * contacts[:-1, :, :, None]
        shares = self.shares(contacts[:-1])
        if self._last is None:
            return shares
        before = self._last.inputs[0]
        loaded = before[..., 2] > 0
        known = contacts[:-1] & loaded & contacts[0]
        return np.where(known[..., None], before, shares)

    def _fallback(
        self, time: float, states: RobotStates, contacts: np.ndarray, failed: LayeredPlan
    ) -> LayeredPlan:
        self.events.append(Event(time, EventKind.KEPT_PLAN, failed.event))
        if self._last is not None:
            plan = self._last.shifted(time - self._last.time)
        else:
            n = self.settings.horizon
            x = np.zeros((n + 1, self.team.robots, 12))
            x[:, :, 0:3], x[:, :, 3:6] = states.position, states.velocity
            x[:, :, 9:12] = states.angular_velocity
            rows = sum(bar.rows for bar in self.team.bars)
            plan = LayeredPlan(
                time, self.settings.dt, x, states.rotation, self.shares(contacts[:-1]),
                np.zeros((n, rows)), np.zeros((self.team.robots, rows)),
            )  # fmt: skip
        inputs = plan.inputs * contacts[:-1, :, :, None]
        return replace(
            plan, inputs=inputs, status=failed.status, event=failed.event, is_usable=False
        )
