"""A receding-horizon planner for a team: references, gaits and warm starts around one `Sqp`."""

from __future__ import annotations

import time as clock
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from palanquin.candidates import Candidates
from palanquin.errors import ProblemError
from palanquin.events import Event, EventKind, plan_events
from palanquin.lowered import NamedArray
from palanquin.plan import Plan, Sqp, Status
from palanquin.policies import Policy
from palanquin.problem import Problem
from palanquin.problems import checks
from palanquin.problems.clm.columns import Columns, GroundColumns
from palanquin.problems.clm.footholds import raibert_footholds
from palanquin.problems.clm.guess import carrying_forces, fill_guess, footholds
from palanquin.problems.clm.landing import landings, mid_stance_feet
from palanquin.problems.clm.parameters import set_contacts, set_references, set_terrain
from palanquin.problems.clm.references import (
    VELOCITY,
    References,
    RobotReferences,
    Velocity,
    make_references,
    nominal_state,
    payload_path,
)
from palanquin.problems.clm.standing_ground import StandingGround
from palanquin.problems.clm.starts import foothold_starts
from palanquin.problems.clm.team import Team
from palanquin.problems.gaits import GaitClock
from palanquin.problems.modules.ditches import padded_lines
from palanquin.problems.terrains import Flat, Terrain

FootholdRule = Literal["hips", "raibert"]

# Feet in the air push with less than this, N: in the paper's unreduced form their forces are
# variables, which the solver leaves at some rounding error.
_NO_FORCE = 1e-3


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
        solve_ms: wall time from measurement to plan, references and warm start included; the
            solver's own is in `plan.timings_ms`.
        columns: where the team stands in the plan's knot vectors.
        events: what went otherwise than by full steps.
    """

    plan: Plan
    references: References
    contacts: np.ndarray
    solve_ms: float
    columns: Columns = field(repr=False)
    events: tuple[Event, ...] = ()

    @property
    def bodies(self) -> np.ndarray:
        """Planned states [N+1, R+1, 13]."""
        return self.plan.xs[:, self.columns.bodies]

    @property
    def feet(self) -> np.ndarray:
        """Planned feet in the world [N, R, 4, 3], m."""
        return self.plan.xs[:-1, self.columns.feet]

    @property
    def forces(self) -> np.ndarray:
        """Planned ground reaction forces in the world [N, R, 4, 3], N."""
        return self.plan.xs[:-1, self.columns.forces]

    @property
    def hand_wrenches(self) -> np.ndarray:
        """Planned force and torque of the payload on each hand, world, [N, R, 6], N and N m."""
        return self.plan.xs[:-1, self.columns.wrenches]


@dataclass(frozen=True)
class _Instant:
    """What is known before a solve, at `time` (s).

    `references` over the horizon; `contacts` [N+1, R, 4] and the flags just `before` [R, 4];
    measured `feet` [R, 4, 3].
    """

    time: float
    references: References
    contacts: np.ndarray
    before: np.ndarray
    feet: np.ndarray

    def carried(self, wanted: np.ndarray) -> np.ndarray:
        """`wanted` feet [N+1, R, 4, 3], but those that stand stay."""
        return footholds(wanted, self.contacts, self.before, self.feet)


class Planner:
    """Plans for a team at any rate: call `solve` with the time, the measured state and a command.

    The payload's reference starts where the last one has come to and follows the command; gaits run
    on clocks of their own; the last plan, shifted by the time that has passed, is the warm start.

    Args:
        problem: built from modules with grasps of a body called "payload", or by `build_clm`.
        terrain: the ground, of the kind that the problem was built with; flat unless told.
        ditches: lines (a, b, c, width) that feet must not step into, [n, 4], m; at most as many as
            the problem was built for, whose own they are unless told.
        candidates: how many choices of footholds (sides of ditches, areas) are solved side by side
            every period; the first is the last plan's own. One is enough where every foot may take
            the nearest.
        footholds: reference footholds: "hips" projects the reference pose's hips at every knot, as
            the paper does; "raibert" looks ahead, see `raibert_footholds`.
        references: "ground" has each robot follow the ground below it, within its legs' reach,
            "rigid" the whole team move as one body, as in the paper (14).
        restart_after: so many solves in a row without a usable plan are answered by the last plan
            shifted once more; then the next one starts from the references.
        team: what the problem was built for; read from its grasps unless told, with the payload at
            the height at which the first robot stands nominally.
        **options: fields of `SqpSettings`; one iteration a solve unless told.

    Example:
        >>> planner = Planner(build_clm(team), qp="structured")
        >>> state = planner.nominal_state()
        >>> plan = planner.solve(0.0, state, Velocity(0.4)).plan
    """

    def __init__(
        self,
        problem: Problem,
        terrain: Terrain | None = None,
        ditches: ArrayLike = (),
        candidates: int = 1,
        footholds: FootholdRule = "hips",
        references: RobotReferences = "ground",
        restart_after: int = 1,
        team: Team | None = None,
        **options: Any,
    ) -> None:
        if restart_after < 1:
            raise ProblemError(f"planner.restart_after is {restart_after}; it must be at least 1")
        self.restart_after = restart_after
        if footholds not in get_args(FootholdRule):
            known = ", ".join(get_args(FootholdRule))
            raise ProblemError(f"planner.footholds is {footholds!r}; it must be one of {known}")
        self.team = team or Team.of(problem)
        self.terrain = terrain or Flat()
        self.lowered = problem.lower()
        self.columns = Columns.of(self.lowered, self.team)
        self.footholds = footholds
        self.horizon = self.lowered.horizon
        self.params = self.lowered.parameters()
        set_terrain(self.params, self.terrain)
        self._surroundings = GroundColumns.of(self.lowered, self.team, self.terrain)
        self.dt = float(self.params["dt"][0])
        self.set_ditches(ditches if np.size(ditches) else self._default_ditches())
        options = {"max_iterations": 1, **options}
        self.sqp = Sqp(self.lowered, **options)
        self.candidates = (
            Candidates(self.lowered, candidates, **options) if candidates > 1 else None
        )
        self._robot_references = references
        self.clocks = [GaitClock(carrier.gait) for carrier in self.team.carriers]
        self.reference = np.zeros(3)  # payload's x, y, yaw
        self._start = 0.0  # when the first plan was made
        self._time: float | None = None
        self._command = Velocity()
        self._last: TeamPlan | None = None
        self._failures = 0  # solves in a row without a usable plan

    def set_ditches(self, lines: ArrayLike) -> None:
        """Takes other ditches (a, b, c, width) [n, 4], m; raises ProblemError for too many."""
        self.ditches = np.asarray(lines, dtype=float).reshape(-1, 4)
        if "ditches" in self.params:
            at_most = self.params["ditches"].shape[1]
            self.params["ditches"] = padded_lines(self.ditches, at_most)
        elif len(self.ditches):
            raise ProblemError("ditches are given, but the problem was built for none")
        self._ground = StandingGround(self.terrain, self.ditches)

    def _default_ditches(self) -> np.ndarray:
        lines = self.params["ditches"][0] if "ditches" in self.params else np.empty((0, 4))
        return lines[lines[:, 3] > 0]

    def restart(self, reference: ArrayLike = (0.0, 0.0, 0.0)) -> None:
        """Forgets the last plan and the time; the payload's reference starts at (x, y, yaw)."""
        self.reference = checks.array("reference", reference, 3)
        self._time, self._last, self._failures = None, None, 0

    def nominal_state(self, start: np.ndarray | None = None) -> TeamState:
        """Standing at payload pose (x, y, yaw), the reference's start unless told."""
        return TeamState(
            *nominal_state(
                self.team,
                self.terrain,
                self.reference if start is None else start,
                self._robot_references,
            )
        )

    def contacts(self, times: np.ndarray) -> np.ndarray:
        """Contact flags [n, R, 4] at `times` [n], s."""
        return np.stack([c.contacts(times) for c in self.clocks], axis=1)

    def set_policy(self, family: str, policy: Policy) -> None:
        """Changes how an inequality family enters; needs no lowering."""
        for solver in (self.sqp, self.candidates):
            if solver is not None:
                solver.set_policy(family, policy)

    def expect_wrenches(self, wrenches: np.ndarray) -> None:
        """Tells the planner of pushes to come: force and torque (world, N and N m) on each body
        during the intervals of the horizon that the next plan is for, [N+1, R+1, 6].
        """
        for b, body in enumerate(self.team.bodies):
            self.params[f"{body}.external_force"] = wrenches[:, b, :3]
            self.params[f"{body}.external_torque"] = wrenches[:, b, 3:]

    def reference_at(self, time: float) -> np.ndarray:
        """The payload's reference (x, y, yaw) [3], m and rad, at `time` (s, not before the last
        plan's) if the command stays.
        """
        elapsed = 0.0 if self._time is None else time - self._time
        if elapsed <= 0:
            return self.reference
        trend = self.terrain.trend
        return payload_path(trend, self.reference, self._command, 1, elapsed).pose[1]

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
        references = self._references(time, state, command)
        now = _Instant(time, references, *self._contacts(time), state.feet)
        set_references(self.params, self.team, references)
        set_contacts(self.params, self.team, now.contacts, now.before)
        measured = self.lowered.knot()
        measured.values[self.columns.bodies] = state.bodies
        measured.values[self.columns.feet] = state.feet
        events = self._give_up_on_last(time)
        guess = self._guess(now, elapsed)
        if self.candidates is None:
            plan = self.sqp.solve(self._around(guess), measured, guess)
        else:
            guesses = self._choices(now, guess)
            around = [self._around(start) for start in guesses]
            plan = self.candidates.solve(around, measured, guesses).plan
        solve_ms = 1e3 * (clock.perf_counter() - start)
        self._failures = 0 if plan.is_usable else self._failures + 1
        events += plan_events(plan, time)
        self._last = TeamPlan(plan, references, now.contacts, solve_ms, self.columns, events)
        return self._last

    def settle(
        self, time: float, state: TeamState, command: Velocity, at_most: int = 30
    ) -> TeamPlan:
        """Solves one instant again and again, `at_most` so often, until the plan has converged.

        A team that still stands has the time for it; afterwards `solve` starts from a good plan.
        Raises as `solve`.
        """
        for _ in range(at_most):
            plan = self.solve(time, state, command)
            if plan.plan.status == Status.CONVERGED:
                break
        return plan

    def _advance_reference(self, time: float, command: Velocity) -> float:
        """Moves the payload's reference on by the time since the last call; returns that time."""
        time = checks.finite("time", time)
        if self._time is None:
            self._start = self._time = time
        elapsed = time - self._time
        if elapsed < 0:
            raise ProblemError(f"time is {time} s; the last plan was made at {self._time} s")
        self.reference = self.reference_at(time)
        self._time, self._command = time, command
        return elapsed

    def _contacts(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Flags at the knots [N+1, R, 4], and just before `time` [R, 4].

        A foot that stood before and stands now stays where it was measured; so does, at the start,
        every foot that stands.
        """
        just_before = max(time - 1e-3 * self.dt, self._start)
        knots = time + self.dt * np.arange(self.horizon + 1)
        flags = self.contacts(np.append(just_before, knots))
        return flags[1:], flags[0]

    def _references(self, time: float, state: TeamState, command: Velocity) -> References:
        """The reference motion over the horizon."""
        references = make_references(
            self.team,
            self.terrain,
            self.reference,
            command,
            self.horizon,
            self.dt,
            self._robot_references,
        )
        if self.footholds == "hips":
            return references
        robots = references.bodies[:, 1:]
        times = time + self.dt * np.arange(self.horizon + 1)
        begin, end = zip(*(c.stances(times) for c in self.clocks), strict=True)
        footholds = raibert_footholds(
            self.team,
            robots,
            self.terrain,
            times,
            (np.stack(begin, axis=1), np.stack(end, axis=1)),
            (state.bodies[1:, VELOCITY] - robots[0, :, VELOCITY])[:, :2],
        )
        return References(references.bodies, footholds)

    def _give_up_on_last(self, time: float) -> tuple[Event, ...]:
        """Forgets the last plan when too many solves in a row have failed to improve on it."""
        if self._last is None or self._failures < self.restart_after:
            return ()
        reason = f"solves in a row without a usable plan: {self._failures}"
        self._last, self._failures = None, 0
        return (Event(time, EventKind.RESTART, reason),)

    def _guess(self, now: _Instant, elapsed: float) -> NamedArray:
        """The last plan, shifted; without one, the references.

        Where feet may not stand everywhere, those that no plan has placed on the ground yet start
        where they may: one that was in the air at the last plan's end would otherwise keep to the
        near side of a ditch, step after step, long after the reference has crossed.
        """
        last = self._last
        if last is None:
            guess = self._from_references(now)
        else:
            guess = self._shifted(last, elapsed, now.contacts)
        if not self._ground.is_whole:
            clear = self._ground.nearest(self._aims(now))
            times = elapsed + self.dt * np.arange(self.horizon + 1)
            was_planned = (times < (self.horizon - 0.5) * self.dt) & (last is not None)
            kept = now.contacts & was_planned[:, None, None]
            feet = np.where(kept[..., None], guess.values[:, self.columns.feet], clear)
            guess.values[:, self.columns.feet] = now.carried(feet)
        return guess

    def _from_references(self, now: _Instant) -> NamedArray:
        guess = self.lowered.trajectory()
        feet = now.carried(now.references.feet())
        fill_guess(guess, self.team, now.references, now.contacts, feet)
        return guess

    def _shifted(self, last: TeamPlan, elapsed: float, contacts: np.ndarray) -> NamedArray:
        """The last plan as seen `elapsed` seconds later.

        Where a foot stands that the last plan had in the air, it starts with its share of the
        weight: at zero force all its friction rows are at their kinks, from which the subproblem
        frees itself in steps of the penalties' smoothing width.
        """
        guess = self.lowered.shift(last.plan.trajectory, self.params, elapsed)
        forces = guess.values[:, self.columns.forces]
        idle = contacts & (np.abs(forces).max(axis=-1) < _NO_FORCE)
        shares = carrying_forces(self.team, contacts)
        guess.values[:, self.columns.forces] = np.where(idle[..., None], shares, forces)
        return guess

    def _aims(self, now: _Instant) -> np.ndarray:
        """Where feet should land, whatever the ground there, [N+1, R, 4, 3], world, m."""
        if self.footholds == "raibert":  # they look ahead themselves
            return now.references.feet()
        gaits = [clock.gait(now.time) for clock in self.clocks]
        stance = np.array([gait.period * np.array(gait.duty) for gait in gaits])
        landing = landings(now.contacts, now.before)
        return mid_stance_feet(now.references, landing, stance, self.terrain)

    def _choices(self, now: _Instant, guess: NamedArray) -> list[NamedArray]:
        """The guess, and copies of it whose feet land elsewhere."""
        at_most = len(self.candidates.solvers) - 1 if self.candidates else 0
        aims = self._aims(now)
        guesses = [guess]
        for start in foothold_starts(aims, now.contacts, now.before, self._ground.options, at_most):
            other = guess.copy()
            other.values[:, self.columns.feet] = now.carried(start)
            guesses.append(other)
        return guesses

    def _around(self, guess: NamedArray) -> NamedArray:
        """The parameters, with those of the ground around the guess' feet."""
        if not self._surroundings:
            return self.params
        params = self.params.copy()
        self._surroundings.fill(params, self.terrain.around(guess.values[:, self.columns.feet]))
        return params
