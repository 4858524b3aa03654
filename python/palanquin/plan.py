"""Solvers as a user calls them, and the plan that they return."""

from __future__ import annotations

import copy
import functools
import itertools
import logging
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palanquin import _core
from palanquin.errors import LoweringError, PalanquinError, ProblemError
from palanquin.evaluation import Evaluation, core_policy
from palanquin.instance import Instance, Method
from palanquin.lowered import Lowered
from palanquin.named_array import NamedArray
from palanquin.plan_report import (
    NonFiniteReport,
    PlanReport,
    RowReport,
    by_constraint,
    plan_report,
)
from palanquin.policies import Policy
from palanquin.problem import checked_horizon
from palanquin.settings import configure

if TYPE_CHECKING:
    from palanquin.sensitivity import Sensitivities

Status = _core.Status
logger = logging.getLogger("palanquin.dump")

SQP_PHASES = ("transcribe", "linearize", "update", "solve", "globalize")
"""Of an SQP step: inputs taken over and roles settled; derivatives; the QP's factorisation; its
solution; evaluations and line search."""


@dataclass
class Plan:
    """Outcome of a solve. The trajectory is the last accepted iterate whatever the status says.

    A plan is a value: it says the same whatever its solver does afterwards, may be read by any
    thread, and pickles (see `Evaluation`). Costs and violations are NaN where the status is
    NON_FINITE.

    Attributes:
        trajectory: plan.trajectory["block"] is a view [N + 1, size].
        status: why the solver stopped.
        is_usable: whether the plan may be executed: the solve ended well, and no equality or hard
            row is violated by more than the solver's `usable_violation`.
        message: the status in words.
        evaluation: what follows is read from it.
        certificate: of INFEASIBLE by the SQP, what proves it: the rows that the proof needs, with
            weights y of norm 1 (`multiplier`) for which the rows' derivatives cancel each other
            along the dynamics, while sum y * value > 0. The point is a stationary one of the
            violation.
        non_finite: of NON_FINITE, the first value that was not finite.
        iterations: a record per SQP iteration (empty for Ipopt).
        iteration_count: number of iterations.
        timings_ms: milliseconds per phase, and "total".
        instance: what the solver was asked; None in a pickled copy.
    """

    trajectory: NamedArray
    status: _core.Status
    is_usable: bool
    message: str
    evaluation: Evaluation
    iterations: list[_core.IterationRecord]
    iteration_count: int
    timings_ms: dict[str, float]
    certificate: list[RowReport] = field(default_factory=list, repr=False)
    non_finite: NonFiniteReport | None = None
    instance: Instance | None = field(default=None, repr=False, compare=False)

    def rows(self) -> list[RowReport]:
        """Every row at every knot: value and multiplier, by constraint, owner, limb, row and knot.

        Multipliers are those of the last QP, or Ipopt's; a pickled copy has the rows too.
        """
        return self.evaluation.rows()

    @property
    def multipliers(self) -> dict[str, NDArray[np.float64]]:
        """Multipliers [N + 1, m] of every constraint, and of "dynamics of BLOCK".

        A constraint's m rows are in the order of statement: by owner, limb and index. NaN where a
        knot does not have the row, or the solver no multiplier for it; signs as in `rows`.
        """
        return by_constraint(self.rows(), len(self.trajectory.values) - 1)

    def sensitivities(self) -> Sensitivities:
        """How the plan changes with the measured state and the parameters, to first order.

        Raises:
            ProblemError: the plan has not converged, is a pickled copy, or has no derivatives.
        """
        from palanquin.sensitivity import Sensitivities

        return Sensitivities(self)

    def dump(self, path: str | os.PathLike[str]) -> Path:
        """Writes the solve as one file, which `palanquin solve FILE` and `palanquin.read_dump`
        repeat on any machine: code, parameters, measurement, guess, settings, policies.

        Returns:
            The path.

        Raises:
            ProblemError: this is a pickled copy.
            OSError: it cannot be written.
        """
        from palanquin.dump import write_dump

        if self.instance is None:
            raise ProblemError("a pickled plan has its results alone; it cannot be dumped")
        return write_dump(path, self.instance, self)

    def report(self, count: int = 5) -> PlanReport:
        """Why the solve ended as it did, and whether its plan may be executed; `count` worst rows.

        Raises ProblemError for a pickled copy.
        """
        if self.instance is None:
            raise ProblemError("a pickled plan has its results alone; explain it before")
        return plan_report(self, count)

    def explain(self, count: int = 5) -> str:
        """The report as text."""
        return str(self.report(count))

    def __getstate__(self) -> dict[str, Any]:
        """Results alone: an instance would be lowered again."""
        return {**self.__dict__, "instance": None}

    @property
    def tracking_cost(self) -> float:
        """Objective without penalties."""
        return self.evaluation.tracking_cost

    @property
    def penalty_cost(self) -> float:
        """Sum of all penalties."""
        return self.evaluation.penalty_cost

    @property
    def cost(self) -> float:
        """Objective with penalties."""
        return self.evaluation.cost

    @property
    def equality_violation(self) -> float:
        """Largest residual of dynamics, equality and link rows."""
        return self.evaluation.equality_violation

    @property
    def xs(self) -> NDArray[np.float64]:
        """The knot vectors [N + 1, nz]; use `trajectory` for named blocks."""
        return self.trajectory.values

    @property
    def violation(self) -> dict[str, float]:
        """Largest violation of each inequality family, in physical units."""
        return self.evaluation.violation

    def worst_rows(self, count: int = 5) -> list[tuple[str, float]]:
        """Names and residuals of the worst rows: constraint, robot, limb, row, knot."""
        return self.evaluation.worst_rows(count)


Settings = TypeVar("Settings", _core.SqpSettings, _core.IpoptSettings)


class _Solver(Generic[Settings]):
    """What Sqp and Ipopt share: settings, default policies, inputs, guesses, dumps."""

    _settings_type: type[Settings]
    _method: ClassVar[Method]

    def __init__(
        self,
        lowered: Lowered,
        settings: Settings | None = None,
        *,
        horizon: int | None = None,
        dump_on_failure: str | os.PathLike[str] | None = None,
        **options: Any,
    ) -> None:
        self.lowered = lowered
        self.policies: dict[str, Policy] = {}
        self._dumps = dump_on_failure and _Dumps(Path(dump_on_failure))
        self.horizon = checked_horizon(lowered.horizon if horizon is None else horizon)
        self.settings: Settings = configure(settings or self._settings_type(), **options)
        self._settings_in_use: Any = copy.copy(self.settings)
        self._core = self._make_core()
        for family, policy in lowered.policies.items():
            self.set_policy(family, policy)

    def _make_core(self) -> Any:
        """The engine's solver for `lowered`, `horizon` and `settings`."""
        raise NotImplementedError

    def set_policy(self, family: str, policy: Policy) -> None:
        """Changes how an inequality family enters, from the next `solve` or `prepare` on; needs no
        lowering.
        """
        self._core.set_policy(family, core_policy(policy))
        self.policies[family] = policy

    def dump(
        self,
        path: str | os.PathLike[str],
        parameters: NamedArray | ArrayLike,
        measured: NamedArray | ArrayLike,
        guess: NamedArray | ArrayLike | None = None,
    ) -> Path:
        """Writes what `solve` would be asked as one file, without solving; see `Plan.dump`."""
        from palanquin.dump import write_dump

        return write_dump(path, self._instance(*self._inputs(parameters, measured, guess)))

    def _instance(
        self,
        parameters: NDArray[np.float64],
        measured: NDArray[np.float64],
        guess: NDArray[np.float64],
        predicted: NDArray[np.float64] | None = None,
    ) -> Instance:
        """With copies of what the caller may change."""
        return Instance(
            self.lowered, self._method, self._settings_in_use, dict(self.policies),
            parameters.copy(), measured.copy(), guess.copy(), predicted,
        )  # fmt: skip

    def _plan(self, found: _core.Plan, timings_ms: dict[str, float], instance: Instance) -> Plan:
        """The engine's plan, with names; dumped if it failed and that is asked for."""
        plan = Plan(
            trajectory=self.lowered.wrap(found.trajectory),
            status=found.status,
            is_usable=found.is_usable,
            message=found.message,
            evaluation=Evaluation.of(found.evaluation, found),
            iterations=found.history,
            iteration_count=found.iterations,
            timings_ms=timings_ms,
            certificate=_weighted(found.certificate_rows()),
            non_finite=_non_finite(found.non_finite),
            instance=instance,
        )
        if self._dumps and not plan.is_usable:
            self._dumps.keep(plan)
        return plan

    def _inputs(
        self,
        parameters: NamedArray | ArrayLike,
        measured: NamedArray | ArrayLike,
        guess: NamedArray | ArrayLike | None = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        p = np.asarray(parameters, float)
        steps = self.lowered.time_steps(p)
        if np.any(steps <= 0):
            k = int(np.argmax(steps <= 0))
            raise ProblemError(f"parameter 'dt' is {steps[k]} at knot {k}; it must be positive")
        z = np.asarray(measured, float)
        start = np.tile(z, (self.horizon + 1, 1)) if guess is None else np.asarray(guess, float)
        return p, z, np.ascontiguousarray(start)


def _weighted(rows: list[_core.RowState]) -> list[RowReport]:
    """Rows whose weights are more than rounding."""
    return [RowReport.of(row) for row in rows if abs(row.multiplier) > 1e-9]


def _non_finite(found: _core.NonFinite | None) -> NonFiniteReport | None:
    return NonFiniteReport(found.function, found.what, found.knot) if found else None


class _Dumps:
    """A folder for the dumps of plans that may not be executed: the first few of a solver."""

    MOST = 10
    _numbers = itertools.count(1)

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._left = self.MOST

    def keep(self, plan: Plan) -> None:
        """Writes a dump; what keeps it from being written is logged, and disturbs nobody."""
        if plan.instance is None or not self._left:
            return
        self._left -= 1
        number = f"{os.getpid()}-{next(self._numbers)}"
        name = f"{plan.instance.lowered.name}-{plan.status.name.lower()}-{number}.palanquin"
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            plan.dump(self._folder / name)
        except (OSError, PalanquinError) as error:
            logger.warning("a failed solve was not dumped: %s", error)
        else:
            logger.info("a failed solve was dumped: %s", self._folder / name)


def _exact_library(lowered: Lowered, is_must: bool) -> str:
    """Path of the functions of exact Hessians; "" where they are no must and cannot be made."""
    try:
        return lowered.library("exact")
    except LoweringError as error:
        if is_must:
            raise
        logging.getLogger("palanquin.lowering").warning(
            "'%s' has no exact Hessians, its solver stays with Gauss-Newton's: %s",
            lowered.name, error,
        )  # fmt: skip
        return ""


class Sqp(_Solver[_core.SqpSettings]):
    """The SQP solver of a lowered problem.

    It serves one thread at a time: a call that meets another one is a RuntimeError.

    Args:
        lowered: the problem.
        settings: from `sqp_settings`; or give its fields as options.
        horizon: number of intervals N; the problem's own unless told.
        dump_on_failure: folder in which the first 10 solves are dumped whose plans may not be
            executed (see `Plan.dump`). `advance`, which makes no plans, dumps nothing.
        **options: fields of `SqpSettings`, nested ones as dicts, for example
            `qp="osqp", max_iterations=1, subproblem={"max_inner_iterations": 3}`.

    Raises:
        ProblemError: an unknown option (the message lists the valid ones).
        ValueError: a setting breaks its rule.
    """

    _settings_type = _core.SqpSettings
    _method = "sqp"
    _prepared: tuple[NDArray[np.float64], ...] = ()

    def _make_core(self) -> _core.Sqp:
        is_must = self.settings.hessian == _core.HessianKind.EXACT
        # Not a method of this object: the core may not keep what keeps the core.
        library = functools.partial(_exact_library, self.lowered, is_must)
        return _core.Sqp(self.lowered.core, self.horizon, self.settings, library)

    def solve(
        self,
        parameters: NamedArray | ArrayLike,
        measured: NamedArray | ArrayLike,
        guess: NamedArray | ArrayLike | None = None,
    ) -> Plan:
        """Solves from a guess.

        Args:
            parameters: from `lowered.parameters(horizon)`, [N + 1, np].
            measured: knot vector [nz]: states at knot 0, other blocks as they were before it.
            guess: trajectory [N + 1, nz]; the measured knot held unless told.

        Returns:
            The plan; numerical failure is in its status, never an exception.
        """
        p, z, start = self._inputs(parameters, measured, guess)
        found = self._core.solve_plan(p, z, start)
        return self._plan(found, _phases(found), self._instance(p, z, start))

    def advance(
        self,
        parameters: NDArray[np.float64],
        measured: NDArray[np.float64],
        guess: NDArray[np.float64],
    ) -> _core.Status:
        """`solve` on bare arrays [N + 1, np], [nz], [N + 1, nz], for loops at kilohertz.

        The result is in `latest`, `model_cost` and `message`; no `Plan` is made.
        """
        return self._core.solve(parameters, measured, guess)

    @property
    def latest(self) -> NDArray[np.float64]:
        """The trajectory [N + 1, nz] of the last solve."""
        return self._core.trajectory

    @property
    def is_usable(self) -> bool:
        """Whether it may be executed, see `Plan`."""
        return self._core.is_usable

    @property
    def model_cost(self) -> float:
        """Cost of the last QP at its solution: what a linear MPC minimises."""
        return self._core.model_cost

    @property
    def message(self) -> str:
        """Which test stopped the last solve, in words."""
        return self._core.message

    @property
    def times_ms(self) -> _core.PhaseTimes:
        """Milliseconds per phase of the last solve."""
        return self._core.times

    @property
    def dynamics_multipliers(self) -> NDArray[np.float64]:
        """Multipliers of the dynamics in the last QP, [N, ndx]; row k from knot k to k + 1."""
        return self._core.dynamics_multipliers

    def prepare(
        self,
        parameters: NamedArray | ArrayLike,
        predicted: NamedArray | ArrayLike,
        guess: NamedArray | ArrayLike | None = None,
    ) -> bool:
        """First phase of a real-time iteration: all that needs no measurement (Diehl et al. 2005).

        Linearises around `guess` with the `predicted` knot at its start and factorises the QP.
        Arguments as of `solve`.

        Returns:
            False when a function is not finite there; `feedback` must then not be called.
        """
        p, z, start = self._inputs(parameters, predicted, guess)
        is_ready = bool(self._core.prepare(p, z, start))
        self._prepared = (p.copy(), z.copy(), start.copy())
        return is_ready

    def feedback(self, measured: NamedArray | ArrayLike) -> Plan:
        """Second phase: the plan for the `measured` knot, whose states alone may differ from the
        predicted one. `timings_ms["feedback"]` is what it took.

        Raises:
            RuntimeError: nothing was prepared.
        """
        z = np.asarray(measured, float)
        found = self._core.feedback_plan(z)
        p, predicted, start = self._prepared
        timings_ms = {**_phases(found), "feedback": found.feedback_ms}
        return self._plan(found, timings_ms, self._instance(p, z, start, predicted))

    def answered(
        self,
        measured: NDArray[np.float64],
        guess: NDArray[np.float64],
        predicted: NDArray[np.float64] | None = None,
    ) -> Plan:
        """The last solve as a plan where the engine itself has asked for it; see `solve`.

        Args:
            measured: knot vector [nz] that it started from.
            guess: trajectory [N + 1, nz] that it started with.
            predicted: knot vector [nz] that it was prepared with, of a solve in two phases.
        """
        found = self._core.plan()
        timings_ms = _phases(found)
        if predicted is not None:
            timings_ms["feedback"] = found.feedback_ms
        instance = self._instance(found.parameters, measured, guess, predicted)
        return self._plan(found, timings_ms, instance)

    def feedback_gain(self) -> NDArray[np.float64]:
        """dz_0/dx_0 of the last solution [ndz, ndx], in the tangent space: how the first knot's
        free blocks answer to a change of the measured states. Empty unless qp is "structured".
        """
        return self._core.feedback_gain()


def _phases(found: _core.Plan) -> dict[str, float]:
    return {phase: getattr(found.times, phase) for phase in (*SQP_PHASES, "total")}


class Ipopt(_Solver[_core.IpoptSettings]):
    """Ipopt on the same lowered problem: the ground truth. Options: fields of `IpoptSettings`."""

    _settings_type = _core.IpoptSettings
    _method = "ipopt"

    def _make_core(self) -> _core.Ipopt:
        library = self.lowered.library("nlp")
        return _core.Ipopt(self.lowered.core, library, self.horizon, self.settings)

    def solve(
        self,
        parameters: NamedArray | ArrayLike,
        measured: NamedArray | ArrayLike,
        guess: NamedArray | ArrayLike | None = None,
    ) -> Plan:
        """As `Sqp.solve`. Inequalities are hard constraints unless `penalize` is set."""
        p, z, start = self._inputs(parameters, measured, guess)
        found = self._core.solve(p, z, start)
        timings_ms = {"solve": found.times.solve, "total": found.times.total}
        return self._plan(found, timings_ms, self._instance(p, z, start))
