"""A receding-horizon planner for a team: references, gaits and warm starts around one `Sqp`."""

from __future__ import annotations

import time as clock
from dataclasses import dataclass
from typing import Any

import numpy as np

from palanquin.errors import ProblemError
from palanquin.plan import Plan, Sqp
from palanquin.problem import Problem
from palanquin.problems import checks
from palanquin.problems.clm.guess import fill_guess, fill_measured, footholds
from palanquin.problems.clm.parameters import set_contacts, set_references, set_terrain
from palanquin.problems.clm.references import References, Velocity, make_references, nominal_state
from palanquin.problems.clm.team import Team
from palanquin.problems.gaits import GaitClock
from palanquin.problems.robots import FEET
from palanquin.problems.terrains import Flat, Terrain


@dataclass(frozen=True)
class TeamState:
    """What is measured: `bodies` [R+1, 13] (payload, then robots; position m, orientation wxyz body
    to world, velocity world m/s, angular velocity body rad/s) and `feet` [R, 4, 3] (world, m).
    """

    bodies: np.ndarray
    feet: np.ndarray


@dataclass(frozen=True)
class TeamPlan:
    """A plan of one period, with what it was planned for.

    Attributes:
        plan: the solver's outcome.
        references: the reference motion over the horizon.
        contacts: flags [N+1, R, 4] at the knots.
        solve_ms: wall time from measurement to plan, references and warm start included.
    """

    plan: Plan
    references: References
    contacts: np.ndarray
    solve_ms: float

    @property
    def bodies(self) -> np.ndarray:
        """Planned states [N+1, R+1, 13]."""
        return self._stack(("position", "orientation", "velocity", "angular_velocity"))

    @property
    def feet(self) -> np.ndarray:
        """Planned feet in the world [N, R, 4, 3], m."""
        return self._limbs("foot")

    @property
    def forces(self) -> np.ndarray:
        """Planned ground reaction forces in the world [N, R, 4, 3], N."""
        return self._limbs("force")

    @property
    def hand_wrenches(self) -> np.ndarray:
        """Planned force and torque of the payload on each robot's hand, world, [N, R, 6], N, N m."""
        z = self.plan.trajectory
        parts = [np.hstack([z[f"{r}.hand.force"], z[f"{r}.hand.torque"]]) for r in self._robots]
        return np.stack(parts, axis=1)[:-1]

    @property
    def _robots(self) -> list[str]:
        return [name.removesuffix(".hand.force") for name in self.plan.trajectory if "hand.force" in name]

    def _stack(self, parts: tuple[str, ...]) -> np.ndarray:
        z = self.plan.trajectory
        bodies = ["payload", *self._robots]
        return np.stack([np.hstack([z[f"{b}.{p}"] for p in parts]) for b in bodies], axis=1)

    def _limbs(self, part: str) -> np.ndarray:
        z = self.plan.trajectory
        rows = [np.stack([z[f"{r}.{limb}.{part}"] for limb in FEET], axis=1) for r in self._robots]
        return np.stack(rows, axis=1)[:-1]


class Planner:
    """Plans for a team at any rate: call `solve` with the time, the measured state and a command.

    The payload's reference starts where the last one has come to and follows the command; gaits run
    on clocks of their own; the last plan, shifted by the time that has passed, is the warm start.

    Args:
        problem: built from modules with grasps of a body called "payload", or by `build_clm`.
        terrain: the ground, of the kind that the problem was built with; flat unless told.
        **options: fields of `SqpSettings`; one iteration a solve unless told.

    Example:
        >>> planner = Planner(build_clm(team), qp="structured")
        >>> state = planner.nominal_state()
        >>> plan = planner.solve(0.0, state, Velocity(0.4)).plan
    """

    def __init__(self, problem: Problem, terrain: Terrain | None = None, **options: Any) -> None:
        self.team = Team.of(problem)
        self.terrain = terrain or Flat()
        self.lowered = problem.lower()
        self.horizon = self.lowered.horizon
        self.params = self.lowered.parameters()
        set_terrain(self.params, self.terrain)
        self.dt = float(self.params["dt"][0])
        self.sqp = Sqp(self.lowered, **{"max_iterations": 1, **options})
        self.clocks = [GaitClock(carrier.gait) for carrier in self.team.carriers]
        self.reference = np.zeros(3)  # payload's x, y, yaw
        self._time: float | None = None
        self._command = Velocity()
        self._last: TeamPlan | None = None

    def nominal_state(self, start: np.ndarray | None = None) -> TeamState:
        """Standing at payload pose (x, y, yaw), the reference's start unless told."""
        return TeamState(
            *nominal_state(self.team, self.terrain, self.reference if start is None else start)
        )

    def contacts(self, times: np.ndarray) -> np.ndarray:
        """Contact flags [n, R, 4] at `times` [n], s."""
        return np.stack([c.contacts(times) for c in self.clocks], axis=1)

    def solve(self, time: float, state: TeamState, command: Velocity) -> TeamPlan:
        """Plans from a measured state.

        Args:
            time: s; must not go back from one call to the next.
            state: measured bodies and feet.
            command: planar velocity of the payload from now on.

        Raises:
            ProblemError: time goes back, or a measured value is not finite.
        """
        start = clock.perf_counter()
        elapsed = self._advance_reference(time, command)
        references = make_references(
            self.team, self.terrain, self.reference, command, self.horizon, self.dt
        )
        contacts = self.contacts(time + self.dt * np.arange(self.horizon + 1))
        before = self._contacts_before(time)
        set_references(self.params, self.team, references)
        set_contacts(self.params, self.team, contacts, before)
        measured = self.lowered.knot()
        fill_measured(measured, self.team, state.bodies, state.feet)
        guess = self._warm_start(elapsed, references, contacts, before, state.feet)
        plan = self.sqp.solve(self.params, measured, guess)
        solve_ms = 1e3 * (clock.perf_counter() - start)
        self._last = TeamPlan(plan, references, contacts, solve_ms)
        return self._last

    def _advance_reference(self, time: float, command: Velocity) -> float:
        """Moves the payload's reference on by the time since the last call; returns that time."""
        time = checks.finite("time", time)
        elapsed = 0.0 if self._time is None else time - self._time
        if elapsed < 0:
            raise ProblemError(f"time is {time} s; the last plan was made at {self._time} s")
        if elapsed > 0:
            moved = make_references(
                self.team, self.terrain, self.reference, self._command, 1, elapsed
            ).bodies[1, 0, :2]
            self.reference = np.append(moved, self.reference[2] + elapsed * self._command.wz)
        self._time, self._command = time, command
        return elapsed

    def _contacts_before(self, time: float) -> np.ndarray:
        """Which feet stood just before `time`: a foot that did stays where it was measured."""
        return self.contacts(np.array([time - 1e-3 * self.dt]))[0]

    def _warm_start(
        self,
        elapsed: float,
        references: References,
        contacts: np.ndarray,
        before: np.ndarray,
        feet: np.ndarray,
    ) -> Any:
        """The last plan shifted by the time that has passed; at first, the references."""
        if self._last is None or not self._last.plan.is_usable:
            guess = self.lowered.trajectory()
            wanted = footholds(references.feet(), contacts, before, feet)
            fill_guess(guess, self.team, references, contacts, wanted)
            return guess
        return self.lowered.shift(self._last.plan.trajectory, self.params, elapsed)
