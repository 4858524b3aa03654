"""A receding-horizon planner for a team: references, gaits and warm starts around one `Sqp`."""

from __future__ import annotations

import time as clock
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from palanquin.candidates import Candidates
from palanquin.errors import ProblemError
from palanquin.events import Event, EventKind, plan_events
from palanquin.named_array import NamedArray
from palanquin.plan import Plan, Sqp, Status
from palanquin.policies import Policy
from palanquin.problem import Problem
from palanquin.problems import checks
from palanquin.problems.clm.columns import Columns, GroundColumns
from palanquin.problems.clm.footholds import with_raibert_footholds
from palanquin.problems.clm.parameters import (
    set_contacts,
    set_input_blocks,
    set_references,
    set_terrain,
)
from palanquin.problems.clm.references import (
    References,
    RobotReferences,
    Velocity,
    make_references,
    nominal_state,
    payload_path,
)
from palanquin.problems.clm.standing_ground import StandingGround
from palanquin.problems.clm.team import Team
from palanquin.problems.clm.team_plan import TeamPlan, TeamState
from palanquin.problems.clm.warm_start import Instant, WarmStart
from palanquin.problems.gaits import GaitClock
from palanquin.problems.modules.ditches import padded_lines
from palanquin.problems.terrains import Flat, Terrain

FootholdRule = Literal["hips", "raibert"]


@dataclass(frozen=True)
class _Task:
    """A solve that has been set up: what is known, where it starts, when that was begun, and in two
    phases whether the solver is ready to feed back.
    """

    now: Instant
    guess: NamedArray
    started: float
    is_ready: bool = False


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
        input_blocks: for how many knots forces keep their value; more than 1 needs a problem that
            `holds_inputs`.
        references: "ground" has each robot follow the ground below it, within its legs' reach,
            "rigid" the whole team move as one body, as in the paper (14).
        restart_after: so many solves in a row without a usable plan are answered by the last plan
            shifted once more; then the next one starts from the references.
        team: what the problem was built for; read from its grasps unless told, with the payload at
            the height at which the first robot stands nominally.
        **options: fields of `SqpSettings`; one iteration a solve unless told.

    Attributes:
        failed_plan: the plan that began the last row of plans that may not be executed, to explain
            a run that ended badly; None as long as there was none.

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
        input_blocks: int = 1,
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
        set_input_blocks(self.params, self.team, input_blocks)
        self._surroundings = GroundColumns.of(self.lowered, self.team, self.terrain)
        self.dt = float(self.params["dt"][0])
        self._start_from = WarmStart(
            self.lowered,
            self.team,
            self.columns,
            self.params,
            StandingGround(self.terrain, np.empty((0, 4))),
            self._stance,
        )
        self.set_ditches(ditches if np.size(ditches) else self._default_ditches())
        # One iteration leaves residuals at the end of the horizon, where a step has just come into
        # view (a bound's flight: 2 rad/s); they are gone before they are executed.
        options = {"max_iterations": 1, "usable_violation": 5.0, **options}
        self.sqp = Sqp(self.lowered, **options)
        self.candidates = (
            Candidates(self.lowered, candidates, **options) if candidates > 1 else None
        )
        self._robot_references = references
        self.restart()

    def set_ditches(self, lines: ArrayLike) -> None:
        """Takes other ditches (a, b, c, width) [n, 4], m; raises ProblemError for too many."""
        self.ditches = np.asarray(lines, dtype=float).reshape(-1, 4)
        if "ditches" in self.params:
            at_most = self.params["ditches"].shape[1]
            self.params["ditches"] = padded_lines(self.ditches, at_most)
        elif len(self.ditches):
            raise ProblemError("ditches are given, but the problem was built for none")
        self._start_from.ground = StandingGround(self.terrain, self.ditches)

    def _default_ditches(self) -> np.ndarray:
        lines = self.params["ditches"][0] if "ditches" in self.params else np.empty((0, 4))
        return lines[lines[:, 3] > 0]

    def restart(self, reference: ArrayLike = (0.0, 0.0, 0.0)) -> None:
        """Forgets the last plan, the time, changes of gait and expected pushes; the payload's
        reference starts at (x, y, yaw).
        """
        self.reference = checks.array("reference", reference, 3)
        self.clocks = [GaitClock(carrier.gait) for carrier in self.team.carriers]
        self.expect_wrenches(np.zeros((self.horizon + 1, len(self.team.bodies), 6)))
        self._start = 0.0  # when the first plan was made
        self._time: float | None = None
        self._command = Velocity()
        self._last: TeamPlan | None = None
        self._planned_at = 0.0  # what time the last plan is for
        self._prepared: _Task | None = None
        self.failed_plan: Plan | None = None
        self._failures = 0  # solves in a row without a usable plan
        self._events: tuple[Event, ...] = ()  # since the last plan

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
        task = self._set_up(time, state, command)
        measured, guess = self._knot(state), task.guess
        if self.candidates is None:
            return self._answer(task, self.sqp.solve(self._around(guess), measured, guess))
        at_most = len(self.candidates.solvers)
        guesses = self._start_from.choices(task.now, guess, at_most)
        around = [self._around(start) for start in guesses]
        return self._answer(task, self.candidates.solve(around, measured, guesses).plan)

    def prepare(self, time: float, predicted: TeamState, command: Velocity) -> bool:
        """First phase of a plan: all that needs no measurement (Diehl et al. 2005).

        To be called before `time` (s), with the bodies and feet that are expected then; `feedback`
        follows. Raises as `solve`, and ProblemError for a planner with candidates.

        Returns:
            Whether there is anything to feed back to; if not, `feedback` solves from scratch.
        """
        if self.candidates is not None:
            raise ProblemError("a planner with candidates has no two phases; use solve")
        task = self._set_up(time, predicted, command)
        around = self._around(task.guess)
        is_ready = self.sqp.prepare(around, self._knot(predicted), task.guess)
        self._prepared = replace(task, is_ready=is_ready)
        return is_ready

    def feedback(self, state: TeamState) -> TeamPlan:
        """Second phase: the plan from the measured bodies; feet stand where they were predicted.

        `solve_ms` is this phase's time. Raises ProblemError when nothing was prepared.
        """
        task, self._prepared = self._prepared, None
        if task is None:
            raise ProblemError("nothing was prepared; feedback needs a call of prepare before it")
        task, measured = replace(task, started=clock.perf_counter()), self._knot(state)
        if task.is_ready:
            return self._answer(task, self.sqp.feedback(measured))
        around = self._around(task.guess)
        return self._answer(task, self.sqp.solve(around, measured, task.guess))

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

    def _set_up(self, time: float, state: TeamState, command: Velocity) -> _Task:
        """References, contacts and guess for a solve at `time`; the parameters are written."""
        started = clock.perf_counter()
        self._advance_reference(time, command)
        references = self._references(time, state, command)
        contacts, before = self._contacts(time)
        set_references(self.params, self.team, references)
        set_contacts(self.params, self.team, contacts, before)
        now = Instant(time, references, contacts, before, state.feet)
        self._give_up_on_last(time)
        guess = self._start_from.guess(now, self._last, time - self._planned_at)
        return _Task(now, guess, started)

    def _knot(self, state: TeamState) -> NamedArray:
        """The measured knot."""
        knot = self.lowered.knot()
        knot.values[self.columns.bodies] = state.bodies
        knot.values[self.columns.feet] = state.feet
        return knot

    def _answer(self, task: _Task, plan: Plan) -> TeamPlan:
        """The plan with what it was for; the next one starts from it."""
        solve_ms = 1e3 * (clock.perf_counter() - task.started)
        if not plan.is_usable and self._failures == 0:
            self.failed_plan = plan
        self._failures = 0 if plan.is_usable else self._failures + 1
        now, events = task.now, self._events + plan_events(plan, task.now.time)
        self._events = ()
        self._last = TeamPlan(
            plan, now.references, now.contacts, solve_ms, self.columns, events, now.time
        )
        self._planned_at = task.now.time
        return self._last

    def _advance_reference(self, time: float, command: Velocity) -> None:
        """Moves the payload's reference on by the time since the last call."""
        time = checks.finite("time", time)
        if self._time is None:
            self._start = self._time = time
        if time < self._time:
            raise ProblemError(f"time is {time} s; the last plan was made at {self._time} s")
        self.reference = self.reference_at(time)
        self._time, self._command = time, command

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
        if self.footholds == "raibert":
            times = time + self.dt * np.arange(self.horizon + 1)
            return with_raibert_footholds(
                references, self.team, self.terrain, times, self.clocks, state.bodies[1:]
            )
        return references

    def _give_up_on_last(self, time: float) -> None:
        """Forgets the last plan when too many solves in a row have failed to improve on it."""
        if self._last is None or self._failures < self.restart_after:
            return
        reason = f"solves in a row without a usable plan: {self._failures}"
        self._last, self._failures = None, 0
        self._events += (Event(time, EventKind.RESTART, reason),)

    def _stance(self, time: float) -> np.ndarray:
        """How long each foot stands, s, [R, 4]; 0 if its reference footholds look ahead."""
        if self.footholds == "raibert":
            return np.zeros((len(self.clocks), 4))
        return np.array([clock.gait(time).stance for clock in self.clocks])

    def _around(self, guess: NamedArray) -> NamedArray:
        """The parameters, with those of the ground around the guess' feet."""
        if not self._surroundings:
            return self.params
        params = self.params.copy()
        self._surroundings.fill(params, self.terrain.around(guess.values[:, self.columns.feet]))
        return params
