"""Solvers as a user calls them, and the plan that they return."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palanquin import _core, pickling
from palanquin.errors import ProblemError
from palanquin.lowered import Lowered
from palanquin.named_array import NamedArray
from palanquin.policies import Policy
from palanquin.problem import checked_horizon

pickling.register()
Status = _core.Status

SQP_PHASES = ("transcribe", "linearize", "update", "solve", "globalize")
"""Of an SQP step: inputs taken over and roles settled; derivatives; the QP's factorisation; its
solution; evaluations and line search."""


@dataclass
class Plan:
    """Outcome of a solve. The trajectory is the last accepted iterate whatever the status says.

    Attributes:
        trajectory: plan.trajectory["block"] is a view [N + 1, size].
        status: why the solver stopped; `is_usable` whether the plan may be executed.
        message: the same in words.
        cost: tracking_cost + penalty_cost.
        tracking_cost: objective without penalties.
        penalty_cost: sum of all penalties.
        equality_violation: largest residual of dynamics, equality and link rows.
        iterations: a record per SQP iteration (empty for Ipopt).
        iteration_count: number of iterations.
        timings_ms: milliseconds per phase, and "total".
    """

    trajectory: NamedArray
    status: _core.Status
    message: str
    tracking_cost: float
    penalty_cost: float
    equality_violation: float
    iterations: list[_core.IterationRecord]
    iteration_count: int
    timings_ms: dict[str, float]
    _transcription: _core.Transcription = field(repr=False)
    _inputs: tuple[NDArray[np.float64], NDArray[np.float64]] = field(repr=False)

    @property
    def is_usable(self) -> bool:
        """Whether the plan may be executed."""
        return _core.is_usable(self.status)

    @property
    def cost(self) -> float:
        """Objective with penalties."""
        return self.tracking_cost + self.penalty_cost

    @property
    def xs(self) -> NDArray[np.float64]:
        """The knot vectors [N + 1, nz]; use `trajectory` for named blocks."""
        return self.trajectory.values

    @cached_property
    def violation(self) -> dict[str, float]:
        """Largest violation of each inequality family, in physical units."""
        return self._at_inputs().violations(self.trajectory.values)

    def worst_rows(self, count: int = 5) -> list[tuple[str, float]]:
        """Names and residuals of the worst rows: constraint, robot, limb, row, knot."""
        rows = self._at_inputs().worst_rows(self.trajectory.values, count)
        return [(r.name, r.value) for r in rows]

    def _at_inputs(self) -> _core.Transcription:
        # The solver may have moved on to other parameters since.
        self._transcription.set_parameters(self._inputs[0])
        self._transcription.set_measured(self._inputs[1])
        return self._transcription


Settings = TypeVar("Settings", _core.SqpSettings, _core.IpoptSettings)


class _Solver(Generic[Settings]):
    """What Sqp and Ipopt share: settings, default policies, inputs, guesses."""

    _settings_type: type[Settings]

    def __init__(
        self,
        lowered: Lowered,
        settings: Settings | None = None,
        *,
        horizon: int | None = None,
        **options: Any,
    ) -> None:
        self.lowered = lowered
        self.horizon = checked_horizon(lowered.horizon if horizon is None else horizon)
        self.settings: Settings = configure(settings or self._settings_type(), **options)
        self._core = self._make_core()
        for family, policy in lowered.policies.items():
            self.set_policy(family, policy)

    def _make_core(self) -> Any:
        """The engine's solver for `lowered`, `horizon` and `settings`."""
        raise NotImplementedError

    def set_policy(self, family: str, policy: Policy) -> None:
        """Changes how an inequality family enters; needs no lowering."""
        stiffness, smoothing = policy.coefficients()
        self._core.set_policy(family, _core.Policy(policy.kind, stiffness, smoothing))

    def _inputs(
        self,
        parameters: NamedArray,
        measured: NamedArray | ArrayLike,
        guess: NamedArray | ArrayLike | None = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        p = parameters.values
        late = parameters["dt"] <= 0
        if np.any(late):
            k = int(np.argmax(late))
            raise ProblemError(
                f"parameter 'dt' is {parameters['dt'][k]} at knot {k}; it must be positive"
            )
        z = np.asarray(measured, float)
        start = np.tile(z, (self.horizon + 1, 1)) if guess is None else np.asarray(guess, float)
        return p, z, np.ascontiguousarray(start)


class Sqp(_Solver[_core.SqpSettings]):
    """The SQP solver of a lowered problem.

    Args:
        lowered: the problem.
        settings: from `sqp_settings`; or give its fields as options.
        horizon: number of intervals N; the problem's own unless told.
        **options: fields of `SqpSettings`, nested ones as dicts, for example
            `qp="osqp", max_iterations=1, subproblem={"max_inner_iterations": 3}`.

    Raises:
        ProblemError: an unknown option (the message lists the valid ones).
        ValueError: a setting breaks its rule.
    """

    _settings_type = _core.SqpSettings
    _prepared: tuple[NDArray[np.float64], ...] = ()

    def _make_core(self) -> _core.Sqp:
        is_exact = self.settings.hessian == _core.HessianKind.EXACT
        library = self.lowered.library("exact") if is_exact else ""
        return _core.Sqp(self.lowered.core, self.horizon, self.settings, library)

    def solve(
        self,
        parameters: NamedArray,
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
        self._core.solve(p, z, start)
        return self._plan(p, z)

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

    @property
    def transcription(self) -> _core.Transcription:
        """What linearises and evaluates trajectories of the last solve's parameters."""
        return self._core.transcription

    def prepare(
        self,
        parameters: NamedArray,
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
        self._prepared = (p, z)
        return bool(self._core.prepare(p, z, start))

    def feedback(self, measured: NamedArray | ArrayLike) -> Plan:
        """Second phase: the plan for the `measured` knot, whose states alone may differ from the
        predicted one. `timings_ms["feedback"]` is what it took.

        Raises:
            RuntimeError: nothing was prepared.
        """
        z = np.asarray(measured, float)
        self._core.feedback(z)
        plan = self._plan(self._prepared[0], z)
        plan.timings_ms["feedback"] = self._core.feedback_ms
        return plan

    def feedback_gain(self) -> NDArray[np.float64]:
        """dz_0/dx_0 of the last solution [ndz, ndx], in the tangent space: how the first knot's
        free blocks answer to a change of the measured states. Empty unless qp is "structured".
        """
        return self._core.feedback_gain()

    def _plan(self, p: NDArray[np.float64], z: NDArray[np.float64]) -> Plan:
        evaluation, times = self._core.evaluation, self._core.times
        history = self._core.history
        return Plan(
            trajectory=self.lowered.wrap(self._core.trajectory),
            status=self._core.status,
            message=self._core.message,
            tracking_cost=evaluation.cost,
            penalty_cost=evaluation.penalty,
            equality_violation=evaluation.equality_max,
            iterations=history,
            iteration_count=len(history),
            timings_ms={phase: getattr(times, phase) for phase in (*SQP_PHASES, "total")},
            _transcription=self._core.transcription,
            _inputs=(p.copy(), z.copy()),
        )


class Ipopt(_Solver[_core.IpoptSettings]):
    """Ipopt on the same lowered problem: the ground truth. Options: fields of `IpoptSettings`."""

    _settings_type = _core.IpoptSettings

    def _make_core(self) -> _core.Ipopt:
        library = self.lowered.library("nlp")
        return _core.Ipopt(self.lowered.core, library, self.horizon, self.settings)

    def solve(
        self,
        parameters: NamedArray,
        measured: NamedArray | ArrayLike,
        guess: NamedArray | ArrayLike | None = None,
    ) -> Plan:
        """As `Sqp.solve`. Inequalities are hard constraints unless `penalize` is set."""
        p, z, start = self._inputs(parameters, measured, guess)
        result = self._core.solve(p, z, start)
        transcription = self._core.transcription
        evaluation = transcription.evaluate(result.trajectory)
        return Plan(
            trajectory=self.lowered.wrap(result.trajectory),
            status=result.status,
            message=result.message,
            tracking_cost=evaluation.cost,
            penalty_cost=evaluation.penalty if self.settings.penalize else 0.0,
            equality_violation=evaluation.equality_max,
            iterations=[],
            iteration_count=result.iterations,
            timings_ms={"solve": result.milliseconds, "total": result.milliseconds},
            _transcription=transcription,
            _inputs=(p.copy(), z.copy()),
        )


def configure(settings: Any, **options: Any) -> Any:
    """Sets fields of an engine settings struct by name; dicts set nested structs.

    Raises ProblemError for an unknown name or a value of the wrong type.
    """
    known = pickling.fields(settings)
    for name, value in options.items():
        if name not in known:
            raise ProblemError(
                f"{type(settings).__name__} has no field '{name}'; it has {', '.join(known)}"
            )
        current = getattr(settings, name)
        if isinstance(value, np.generic):
            value = value.item()
        if isinstance(value, dict) and not isinstance(current, (str, int, float, Enum)):
            configure(current, **value)
            continue
        if isinstance(value, str) and isinstance(current, Enum):
            value = _member(name, type(current), value)
        try:
            setattr(settings, name, value)
        except TypeError as error:
            raise ProblemError(
                f"{type(settings).__name__}.{name} is {value!r}, "
                f"a {type(value).__name__}; a {type(current).__name__} is needed"
            ) from error
    return settings


def _member(name: str, kind: type[Enum], value: str) -> Enum:
    """The member that a string in lower case names."""
    members = {member.name.lower(): member for member in kind}
    if value not in members:
        raise ProblemError(f"{name} is '{value}'; it must be one of {', '.join(members)}")
    return members[value]
