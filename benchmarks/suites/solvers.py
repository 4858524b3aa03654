"""Who solves the collection: our SQP with a back end and kind of Hessian, Ipopt, and peers."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from palanquin.benchmarks.peers.instance import Instance
from palanquin.benchmarks.peers.ocp_peers import nlpsol_options
from palanquin.benchmarks.peers.stage_nlp import build_stage_nlp
from palanquin.errors import ProblemError
from palanquin.lowered import Lowered
from palanquin.plan import Ipopt, Plan, Sqp
from palanquin.problems.collection import Ocp, Start

MAX_ITERATIONS = 200
TOLERANCE = 1e-8  # of peers


@dataclass(frozen=True)
class Answer:
    """What a solver said, and where it ended.

    Attributes:
        status: a `Status` in lower case, or a peer's own word.
        message: in words.
        trajectory: [N + 1, nz]; empty where the solver does not take the problem.
        iterations: the solver's own.
        milliseconds: of the solve, without set-up.
    """

    status: str
    message: str
    trajectory: np.ndarray = field(repr=False)
    iterations: int
    milliseconds: float

    @staticmethod
    def not_taken(reason: str) -> Answer:
        """Of a solver that refuses the problem's rows."""
        return Answer("not taken", reason, np.empty((0, 0)), 0, 0.0)


Solve = Callable[[Start], Answer]


@dataclass(frozen=True)
class OwnSolver:
    """Our SQP, or Ipopt on the same lowered problem for `qp` "ipopt"."""

    qp: str
    hessian: str = "automatic"

    @property
    def name(self) -> str:
        """What tables call it."""
        return self.qp if self.hessian == "automatic" else f"{self.qp}, exact"

    def prepare(self, ocp: Ocp, lowered: Lowered) -> Solve:
        """Ready to solve `ocp` from any start."""
        solver = self._solver(lowered)

        def solve(start: Start) -> Answer:
            begin = time.perf_counter()
            try:
                plan: Plan = solver.solve(*start)
            except (RuntimeError, ValueError) as error:
                return Answer.not_taken(str(error))
            elapsed = 1e3 * (time.perf_counter() - begin)
            status = plan.status.name.lower()
            return Answer(status, plan.message, plan.xs.copy(), plan.iteration_count, elapsed)

        return solve

    def _solver(self, lowered: Lowered) -> Sqp | Ipopt:
        if self.qp == "ipopt":
            return Ipopt(lowered, penalize=True)
        options: dict[str, Any] = {"max_iterations": MAX_ITERATIONS}
        return Sqp(lowered, qp=self.qp, hessian=self.hessian, **options)


@dataclass(frozen=True)
class CasadiSolver:
    """`casadi.nlpsol` with a plugin on the problem as one program, with exact Hessians."""

    plugin: str

    @property
    def name(self) -> str:
        """What tables call it."""
        return f"casadi {self.plugin}"

    def prepare(self, ocp: Ocp, lowered: Lowered) -> Solve:
        """Ready to solve `ocp` from any start."""
        some = ocp.starts(lowered, random=0)["rest"]
        program = build_stage_nlp(ocp.build(), _instance(some), carry=self.plugin == "fatrop")
        options = nlpsol_options(self.plugin, program, TOLERANCE)
        solver = ca.nlpsol("peer", self.plugin, program.nlp, options)

        def solve(start: Start) -> Answer:
            instance = _instance(start)
            w, p = program.start(instance), program.parameters(instance)
            begin = time.perf_counter()
            point = solver(x0=w, p=p, lbg=program.lower, ubg=0)["x"]
            elapsed = 1e3 * (time.perf_counter() - begin)
            stats = solver.stats()
            trajectory = program.trajectory(np.asarray(point).ravel(), instance)
            status = "converged" if stats["success"] else "failed"
            message = str(stats["return_status"])
            return Answer(status, message, trajectory, stats["iter_count"], elapsed)

        return solve


def _instance(start: Start) -> Instance:
    return Instance(start.parameters, start.measured, start.guess)


Solver = OwnSolver | CasadiSolver

_ALL: tuple[Solver, ...] = (
    OwnSolver("structured"),
    OwnSolver("structured", "exact"),
    OwnSolver("multipliers"),
    OwnSolver("multipliers", "exact"),
    OwnSolver("osqp"),
    OwnSolver("osqp", "exact"),
    OwnSolver("ipopt"),
    *(CasadiSolver(plugin) for plugin in ("ipopt", "fatrop") if ca.has_nlpsol(plugin)),
)
SOLVERS = {solver.name: solver for solver in _ALL}


def chosen(names: list[str]) -> list[Solver]:
    """The solvers named, all unless told; ProblemError for an unknown name."""
    for name in names:
        if name not in SOLVERS:
            raise ProblemError(f"--solvers {name!r} is unknown; there are {'; '.join(SOLVERS)}")
    return [SOLVERS[name] for name in names] if names else list(SOLVERS.values())
