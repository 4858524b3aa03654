"""What is to be said of a trajectory: cost, violations, worst rows."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palanquin import _core
from palanquin.errors import ProblemError
from palanquin.plan_report import RowReport
from palanquin.policies import Policy

_KEPT_ROWS = 1000  # of a copy that has left the engine


@dataclass
class Evaluation:
    """A trajectory seen through its problem: a value, readable at any time and from any thread.

    Quantities are NaN where a function is not finite. A pickled copy holds results alone: the
    violation of each family and up to 1000 of the worst rows.

    Attributes:
        tracking_cost: objective without penalties.
        penalty_cost: sum of all penalties.
        equality_violation: largest residual of dynamics, equality and link rows.
        hard_violation: largest violation of a row that is `Hard()`.
    """

    tracking_cost: float
    penalty_cost: float
    equality_violation: float
    hard_violation: float
    _at: _core.Snapshot | None = field(repr=False, compare=False)
    _violation: dict[str, float] | None = field(default=None, repr=False, compare=False)
    _all_rows: list[RowReport] = field(default_factory=list, repr=False, compare=False)
    _rows: list[tuple[str, float]] = field(default_factory=list, repr=False, compare=False)

    @staticmethod
    def of(values: _core.Evaluation, at: _core.Snapshot) -> Evaluation:
        """What the engine found of a snapshot."""
        return Evaluation(
            values.cost, values.penalty, values.equality_max, values.inequality_max, at
        )

    @property
    def cost(self) -> float:
        """Objective with penalties."""
        return self.tracking_cost + self.penalty_cost

    @property
    def violation(self) -> dict[str, float]:
        """Largest violation of each inequality family, in physical units."""
        if self._violation is None:
            self._violation = self.snapshot.violations()
        return self._violation

    @property
    def snapshot(self) -> _core.Snapshot:
        """The engine's view of the trajectory with its inputs; a pickled copy has none."""
        if self._at is None:
            raise ProblemError("a pickled evaluation has its results alone")
        return self._at

    def rows(self) -> list[RowReport]:
        """Every row at every knot with its value, see `Plan.rows`."""
        if self._at is None:
            return list(self._all_rows)
        return [RowReport.of(row) for row in self._at.rows()]

    def worst_rows(self, count: int = 5) -> list[tuple[str, float]]:
        """Names and residuals of the worst rows: constraint, robot, limb, row, knot."""
        if self._at is None:
            return self._rows[: max(count, 0)]
        return [(row.name, row.value) for row in self.snapshot.worst_rows(count)]

    def __getstate__(self) -> dict[str, Any]:
        """Without the engine's objects."""
        computed = {
            "_violation": self.violation,
            "_all_rows": self.rows(),
            "_rows": self.worst_rows(_KEPT_ROWS),
        }
        return {**self.__dict__, **computed, "_at": None}


def core_policy(policy: Policy) -> _core.Policy:
    """The engine's view of a policy."""
    return _core.Policy(policy.kind, *policy.coefficients())


def snapshot(
    problem: _core.LoweredProblem,
    form: _core.Form,
    policies: dict[str, Policy],
    parameters: NDArray[np.float64],
    measured: NDArray[np.float64],
    trajectory: NDArray[np.float64],
) -> _core.Snapshot:
    """A trajectory [N + 1, nz] with parameters [N + 1, np] and the measured knot [nz]."""
    named = {family: core_policy(policy) for family, policy in policies.items()}
    return _core.Snapshot(problem, form, parameters, measured, trajectory, named)
