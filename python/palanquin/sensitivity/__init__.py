"""How an optimal plan changes with the initial state and the parameters.

At a solution of the nonlinear program

    min f(w, p)  s.t.  c(w, p) = 0,   c the dynamics, equality and link rows, and active hard rows,

with multipliers y the implicit function theorem on its KKT conditions gives

    [ H  C' ] [ dw ]     [ d(f' + C'y)/dp ]
    [ C  0  ] [ dy ] = - [     dc/dp      ],     H = Hessian of f + y'c,   C = c'

(Fiacco, "Introduction to sensitivity and stability analysis in nonlinear programming", 1983,
theorem 2.1). One sparse factorisation serves all directions. The program is the one that Ipopt
solves, in ambient coordinates; H and C are exact, what p changes comes from differences of exact
first derivatives, of fourth order. Where a row's activity changes, the plan has one-sided
derivatives only, and these are of the side on which it stays as it is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from palanquin import _core
from palanquin.errors import ProblemError
from palanquin.sensitivity.kkt_system import KktSystem
from palanquin.sensitivity.program import Program

if TYPE_CHECKING:
    from palanquin.plan import Plan

Array = NDArray[np.float64]


class Sensitivities:
    """Derivatives of a plan's trajectory, by block: {name: [N + 1, size, directions]}.

    Ambient: the derivative of a quaternion is one of its four entries.
    """

    def __init__(self, plan: Plan) -> None:
        if plan.instance is None:
            raise ProblemError("a pickled plan has its results alone; differentiate it before")
        if plan.status is not _core.Status.CONVERGED:
            raise ProblemError(
                f"the plan ended as {plan.status.name}; only a converged one has derivatives"
            )
        self._program = Program(plan.instance, plan)
        self._system = KktSystem(self._program)

    def to_measured(self, block: str) -> dict[str, Array]:
        """By the measured value of a block: of a state, x_0, in the tangent space (a quaternion's
        three directions); of another block, its value before the horizon.
        """
        program = self._program
        info = program.block(block)
        steps = np.zeros((program.code.core.ndz, info.tangent_size))
        own = slice(info.tangent_offset, info.tangent_offset + info.tangent_size)
        steps[own] = np.eye(info.tangent_size)
        return self._named(self._system.by_measured(program.tangent(program.measured) @ steps))

    def to_parameter(self, name: str, knot: int | None = None) -> dict[str, Array]:
        """By a parameter's entries (row-major), of one knot, or of all knots alike."""
        columns = self._program.parameter(name)
        knots = range(self._program.horizon + 1) if knot is None else [knot]
        if knot is not None and not 0 <= knot <= self._program.horizon:
            raise ProblemError(f"knot is {knot}; 0 to {self._program.horizon} is needed")
        return self._named(self._system.by_parameters(columns, knots))

    def _named(self, changes: Array) -> dict[str, Array]:
        shaped = changes.reshape(self._program.horizon + 1, self._program.nz, -1)
        blocks = self._program.code.blocks
        return {b.name: shaped[:, b.offset : b.offset + b.size] for b in blocks}
