"""One linearisation and one QP at an operating point: what every planner solves at every sample."""

from __future__ import annotations

from typing import Any

import numpy as np

from palanquin import _core
from palanquin.plan import Sqp
from palanquin.problem import Problem
from palanquin.problems.layered.robot import LIMBS

# Stiffness of the acceleration row within the Riccati recursion, over the Hessian's largest entry.
# That is the weight of a rotation, 1e10 times that of a force: the solver's default of 1e6 besides
# leaves pivots of rounding errors where several friction rows are active; below 1e2 refining stalls
# where R_lambda is large.
_EQUALITY_WEIGHT = 1e4


class LinearMpc:
    """A lowered problem with its solver, and its arrays as the engine has them.

    The operating point (x_t, u_{t-1}, lambda_{t-1}) is held at every knot of the guess, so that the
    engine's linearisation about it is (13) and (15); one full step of its QP is the linear MPC.

    Attributes:
        lowered: the problem.
        params: its parameters, of which plans write what they are made from.
        guess: operating points at the knots, [N + 1, nz].
        sqp: the solver.
        core: all of this, as the planners of the engine take it.
    """

    def __init__(self, problem: Problem, qp: str = "structured", **options: Any) -> None:
        self.lowered = problem.lower()
        params = self.lowered.parameters()
        options = {"max_iterations": 1, "globalize": False, **options}
        options.setdefault("restoration", {"elastic": False})  # the slack of settings is for that
        options.setdefault("subproblem", {"max_inner_iterations": 1})
        options.setdefault("qp_settings", {"structured": {"equality_weight": _EQUALITY_WEIGHT}})
        self.sqp = Sqp(self.lowered, qp=qp, **options)
        self.core = _core.LinearMpc(self.lowered.core, params.values, self.sqp._core)
        self.params = params.over(self.core.parameters)
        self.guess = self.core.guess
        self._qps = _core.StageQpSource()
        self._places = self.lowered.wrap(np.arange(self.guess.shape[1], dtype=float))

    def columns(self, *blocks: str) -> np.ndarray:
        """Columns of the named blocks in a row of `guess`, one after the other."""
        return np.concatenate([self._places[block] for block in blocks]).astype(int)

    def state_columns(self, robot: str) -> np.ndarray:
        """Columns of (r, v, xi, w), [12]."""
        return self.columns(*(f"{robot}.{part}" for part in ("r", "v", "xi", "w")))

    def force_columns(self, robot: str) -> np.ndarray:
        """Columns of the forces, [4, 3]."""
        return self.columns(*(f"{robot}.{limb}.force" for limb in LIMBS)).reshape(4, 3)

    def linearise(self) -> _core.StageQp:
        """The QP for what stands in `params` and `guess`, valid until the next one."""
        return self._qps.at(self.lowered.snapshot(self.guess, self.params, self.guess[0]))
