"""A solve as a value: all that its answer depends on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from palanquin import _core
from palanquin.lowered import Lowered
from palanquin.policies import Policy

if TYPE_CHECKING:
    from palanquin.plan import Ipopt, Plan, Sqp

Method = Literal["sqp", "ipopt"]


@dataclass(frozen=True, eq=False)
class Instance:
    """What a solver was asked.

    Attributes:
        lowered: the problem.
        method: "sqp" or "ipopt".
        settings: `SqpSettings` or `IpoptSettings`.
        policies: of each inequality family.
        parameters: [N + 1, np].
        measured: knot vector [nz].
        guess: trajectory [N + 1, nz].
        predicted: knot vector [nz] that a two-phase iteration was prepared with; None for a solve
            in one go.
    """

    lowered: Lowered
    method: Method
    settings: _core.SqpSettings | _core.IpoptSettings
    policies: dict[str, Policy]
    parameters: NDArray[np.float64]
    measured: NDArray[np.float64]
    guess: NDArray[np.float64]
    predicted: NDArray[np.float64] | None = None

    @property
    def horizon(self) -> int:
        """Number N of intervals."""
        return len(self.guess) - 1

    def solver(self, **options: Any) -> Sqp | Ipopt:
        """A new solver with these settings and policies, and options as of `Sqp`."""
        from palanquin.plan import Ipopt, Sqp

        kind: Any = Sqp if self.method == "sqp" else Ipopt
        solver: Sqp | Ipopt = kind(self.lowered, self.settings, horizon=self.horizon, **options)
        for family, policy in self.policies.items():
            solver.set_policy(family, policy)
        return solver

    def solve(self, **options: Any) -> Plan:
        """Solves it with a new solver; options as of `Sqp`."""
        from palanquin.plan import Sqp

        solver = self.solver(**options)
        parameters = self.lowered.parameters(self.horizon)
        parameters.values[:] = self.parameters
        if self.predicted is None or not isinstance(solver, Sqp):
            return solver.solve(parameters, self.measured, self.guess)
        solver.prepare(parameters, self.predicted, self.guess)
        return solver.feedback(self.measured)
