"""A receding-horizon planner for a team, as the engine runs it: built here, called from here."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from palanquin import _core
from palanquin.candidates import Candidates
from palanquin.errors import LoweringError, ProblemError
from palanquin.evaluation import core_policy
from palanquin.events import events_of
from palanquin.plan import Plan, Sqp, Status
from palanquin.policies import Policy
from palanquin.problem import Problem
from palanquin.problems import checks
from palanquin.problems.clm.columns import Columns, check_surroundings
from palanquin.problems.clm.observers import Observers
from palanquin.problems.clm.parameters import set_input_blocks, set_terrain
from palanquin.problems.clm.references import (
    References,
    RobotReferences,
    nominal_state,
)
from palanquin.problems.clm.team import Team
from palanquin.problems.clm.team_plan import TeamPlan, TeamState
from palanquin.problems.gaits import Gait, GaitClock
from palanquin.problems.modules.ditches import padded_lines
from palanquin.problems.planning import Command, Measurement, Velocity, plan_time
from palanquin.problems.terrains import Flat, Terrain

FootholdRule = Literal["hips", "raibert"]


_THREADS = 2  # that several candidates are solved by


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
        observers: of wrenches that nobody tells it of, which plans then count on; none unless told.
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
        observers: Observers | None = None,
        restart_after: int = 1,
        team: Team | None = None,
        **options: Any,
    ) -> None:
        if restart_after < 1:
            raise ProblemError(f"planner.restart_after is {restart_after}; it must be at least 1")
        self.restart_after = restart_after
        for name, value, kind in (
            ("footholds", footholds, FootholdRule),
            ("references", references, RobotReferences),
        ):
            if value not in get_args(kind):
                known = ", ".join(get_args(kind))
                raise ProblemError(f"planner.{name} is {value!r}; it must be one of {known}")
        self.team = team or Team.of(problem)
        self.terrain = terrain or Flat()
        self.lowered = problem.lower()
        self.columns = Columns.of(self.lowered, self.team)
        self.footholds, self._observes = footholds, observers is not None
        self.horizon = self.lowered.horizon
        params = self.lowered.parameters()
        set_terrain(params, self.terrain)
        set_input_blocks(params, self.team, input_blocks)
        check_surroundings(self.lowered, self.team, self.terrain)
        self.dt = float(params["dt"][0])
        # One iteration leaves residuals at the end of the horizon, where a step has just come into
        # view (a bound's flight: 2 rad/s); they are gone before they are executed.
        options = {"max_iterations": 1, "usable_violation": 5.0, **options}
        self.candidates = (
            Candidates(self.lowered, candidates, **options) if candidates > 1 else None
        )
        self._solvers = (
            self.candidates.solvers if self.candidates else [Sqp(self.lowered, **options)]
        )
        self._robot_references: RobotReferences = references
        self._core = _core.TeamPlanner(
            self.lowered.core,
            self.team.core,
            self.terrain.core,
            params.values,
            [solver._core for solver in self._solvers],
            looks_ahead=footholds == "raibert",
            on_ground=references == "ground",
            restart_after=restart_after,
            threads=_THREADS,
            observers=(observers or Observers()).core,
        )
        self.params = params.over(self._core.parameters)
        self.clocks = [GaitClock.of(self._core.clock(r)) for r in range(len(self.team.carriers))]
        self.set_ditches(ditches if np.size(ditches) else self._default_ditches())
        self.restart()

    @property
    def sqp(self) -> Sqp:
        """The solver; of several candidates the first."""
        return self._solvers[0]

    @sqp.setter
    def sqp(self, solver: Sqp) -> None:
        """Has another solver do the work from now on; not for a planner with candidates."""
        if self.candidates is not None:
            raise ProblemError("planner.sqp: a planner with candidates keeps its solvers")
        self._core.use_solvers([solver._core])
        self._solvers = [solver]

    def set_ditches(self, lines: ArrayLike) -> None:
        """Takes other ditches (a, b, c, width) [n, 4], m; raises ProblemError for too many."""
        self.ditches = np.asarray(lines, dtype=float).reshape(-1, 4)
        if "ditches" in self.params:
            padded_lines(self.ditches, self.params["ditches"].shape[1])
        elif len(self.ditches):
            raise ProblemError("ditches are given, but the problem was built for none")
        self._core.set_ditches(self.ditches)

    def _default_ditches(self) -> np.ndarray:
        lines = self.params["ditches"][0] if "ditches" in self.params else np.empty((0, 4))
        return lines[lines[:, 3] > 0]

    def restart(self, reference: ArrayLike = (0.0, 0.0, 0.0)) -> None:
        """Forgets the last plan, the time, changes of gait and expected pushes; the payload's
        reference starts at (x, y, yaw).
        """
        self._core.restart(checks.array("reference", reference, 3))
        self._time: float | None = None  # of the last call
        self._is_prepared = self._has_settled = False
        self.failed_plan: Plan | None = None

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

    @property
    def plan_time(self) -> np.ndarray:
        """Times of a plan's knots relative to the measurement [N+1], s."""
        return plan_time(self.horizon, self.dt)

    def contacts(self, times: np.ndarray) -> np.ndarray:
        """Contact flags [n, R, 4] at `times` [n], s."""
        return np.stack([c.contacts(times) for c in self.clocks], axis=1)

    def change_gait(self, robot: int, gait: Gait, time: float, at_once: bool = False) -> float:
        """Has a robot begin another gait, see `GaitClock.change`; returns when that is, s."""
        return self.clocks[robot].change(gait, time, at_once)

    def set_policy(self, family: str, policy: Policy) -> None:
        """Changes how an inequality family enters; needs no lowering."""
        for solver in self._solvers:
            solver.set_policy(family, policy)

    def expect_wrenches(self, wrenches: np.ndarray) -> None:
        """Tells the planner of pushes to come: force and torque (world, N and N m) on each body
        during the intervals of the horizon that the next plan is for, [N+1, R+1, 6].
        """
        self._core.expect_wrenches(np.reshape(wrenches, (self.horizon + 1, -1)))

    @property
    def reference(self) -> np.ndarray:
        """The payload's reference (x, y, yaw) [3], m and rad, at the last plan's time."""
        return self._core.reference

    @reference.setter
    def reference(self, pose: ArrayLike) -> None:
        self._core.reference = checks.array("reference", pose, 3)

    def reference_at(self, time: float) -> np.ndarray:
        """The payload's reference (x, y, yaw) [3], m and rad, at `time` (s, not before the last
        plan's) if the command stays.
        """
        return self._core.reference_at(time)

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Writes the planner as one folder, for C++ programs without Python: the problem, see
        `Lowered.save`, and beside it the file `planner` (C++ `planner_file.hpp` says what is in
        it). C++ `load_planner` reads it; on the same measurements its plans are these, bit by bit.

        The planner is saved as it was built, before its first plan, with its ditches, policies and
        parameters.

        Returns:
            The folder.

        Raises:
            LoweringError: it is a file or holds other things, or cannot be written.
        """
        path = self.lowered.save(folder)
        policies = {name: core_policy(policy) for name, policy in self.sqp.policies.items()}
        try:
            _core.save_planner(self._core, policies, str(path))
        except RuntimeError as error:
            raise LoweringError(str(error)) from error
        return path

    def plan(self, seen: Measurement, command: Command) -> TeamPlan:
        """As of `planning.Planner`: `solve`, but the first plan converges before the clock starts,
        since the team still stands. Raises as `solve`.
        """
        state = TeamState(seen.bodies, seen.feet)
        if not self._has_settled:
            self._has_settled = True
            self.settle(seen.time, state, command.velocity)
        return self.solve(seen.time, state, command.velocity)

    def solve(self, time: float, state: TeamState, command: Velocity) -> TeamPlan:
        """Plans from a measured state.

        Args:
            time: s; must not go back from one call to the next.
            state: measured bodies and feet.
            command: planar velocity of the payload from now on.

        Raises:
            ProblemError: time goes back, or a measured value is not finite.
        """
        self._check_time(time)
        self._is_prepared = False
        with checks.of_the_engine():
            self._core.solve(time, *self._given(state, command))
        return self._answer()

    def prepare(self, time: float, predicted: TeamState, command: Velocity) -> bool:
        """First phase of a plan: all that needs no measurement (Diehl et al. 2005).

        To be called before `time` (s), with the bodies and feet that are expected then; `feedback`
        follows. Raises as `solve`, and ProblemError for a planner with candidates.

        Returns:
            Whether there is anything to feed back to; if not, `feedback` solves from scratch.
        """
        if self.candidates is not None:
            raise ProblemError("a planner with candidates has no two phases; use solve")
        self._check_time(time)
        self._is_prepared = False
        with checks.of_the_engine():
            is_ready = self._core.prepare(time, *self._given(predicted, command))
        self._is_prepared = True
        return is_ready

    def feedback(self, state: TeamState) -> TeamPlan:
        """Second phase: the plan from the measured bodies; feet stand where they were predicted.

        `solve_ms` is this phase's time. Raises ProblemError when nothing was prepared.
        """
        if not self._is_prepared:
            raise ProblemError("nothing was prepared; feedback needs a call of prepare before it")
        self._is_prepared = False
        with checks.of_the_engine():
            self._core.feedback(*_arrays(state))
        return self._answer()

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

    def _given(self, state: TeamState, command: Velocity) -> tuple[Any, ...]:
        """A state and a command as the engine takes them."""
        return (*_arrays(state), command.core)

    def _answer(self) -> TeamPlan:
        """The engine's last plan, with what it was for."""
        core = self._core
        solver = self._solvers[core.chosen]
        predicted = core.predicted if core.has_fed_back else None
        plan = solver.answered(core.measured, core.guess, predicted)
        if core.failures == 1:
            self.failed_plan = plan
        contacts = core.contacts
        return TeamPlan(
            plan,
            References.of(*core.references),
            contacts.reshape(len(contacts), -1, 4),
            core.solve_ms,
            self.columns,
            events_of(core.events),
            core.time,
            self._observed() if self._observes else {},
        )

    def _observed(self) -> dict[str, np.ndarray]:
        """See `TeamPlan.observed`."""
        return {
            "observed_wrench": self._core.observed_wrenches,
            "apparent_payload_mass": np.array(self._core.apparent_payload_mass),
        }

    def _check_time(self, time: float) -> None:
        checks.finite("time", time)
        if self._time is not None and time < self._time:
            raise ProblemError(f"time is {time} s; the last plan was made at {self._time} s")
        self._time = time


def _arrays(state: TeamState) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(state.bodies, dtype=float), np.reshape(state.feet, (-1, 3)).astype(float)
