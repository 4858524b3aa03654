"""Solvers of one QP, each cold, with what it needs set up before the clock starts."""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from palanquin import _core
from palanquin.qp_files import GeneralQp, OcpQp, find_stages
from palanquin.qp_files.general_qp import Array
from palanquin.qp_files.ocp_qp import StagedQp

TOLERANCE = 1e-9  # asked of peers with a tolerance; what is judged is 1e-6


@dataclass(frozen=True)
class Task:
    """A QP in the two forms that solvers take."""

    general: GeneralQp
    staged: OcpQp

    @staticmethod
    def of(qp: GeneralQp | OcpQp) -> Task:
        """A general one is cut into the stages that its pattern tells of."""
        staged = qp if isinstance(qp, OcpQp) else find_stages(qp)
        return Task(staged.general(), staged)

    @property
    def has_stages(self) -> bool:
        """Whether it is cut into knots."""
        return len(self.staged.knots) > 1


@dataclass(frozen=True)
class Answer:
    """A point with the multipliers of all rows, its time, and why it is none."""

    x: Array
    y: Array
    ms: float
    failure: str = ""


CURVATURE_FLOOR = 1e-9
"""For the linear programs among public QPs."""

Solve = Callable[[], Answer]
Solver = Callable[[Task], Solve]


def _timed(call: Callable[[], Any]) -> tuple[Any, float]:
    start = time.perf_counter()
    result = call()
    return result, 1e3 * (time.perf_counter() - start)


def structured(task: Task) -> Solve:
    """Ours. Its pattern is analysed by the first solve, as in a planner's life."""
    staged = StagedQp(task.staged)
    model = _core.PenaltyModel(staged.qp)
    settings = _core.QpSettings()
    settings.multipliers.curvature_floor = CURVATURE_FLOOR
    solver = _core.make_qp_solver("structured", settings)

    def solve() -> Answer:
        solution = _core.StageQpSolution(staged.qp)
        status, ms = _timed(lambda: solver.solve(staged.qp, model, solution))
        if status not in ("solved", "inaccurate"):
            return Answer(*_nothing(task), ms, status)
        solver.find_dynamics_multipliers(solution)
        return Answer(*staged.point(solution), ms)

    return solve


def piqp(task: Task) -> Solve:
    """PIQP, dense."""
    import piqp as peer

    return _piqp(task, peer.DenseSolver, np.asarray)


def piqp_sparse(task: Task) -> Solve:
    """PIQP, sparse; by stages where there are some."""
    import piqp as peer
    from scipy import sparse

    def make() -> Any:
        solver = peer.SparseSolver()
        if task.has_stages:
            solver.settings.kkt_solver = peer.KKTSolver.sparse_multistage
        return solver

    return _piqp(task, make, sparse.csc_matrix)


def _piqp(task: Task, make: Callable[[], Any], kept: Callable[[Array], Any]) -> Solve:
    qp, equal = task.general, task.general.is_equality
    P, A, G = kept(qp.P), kept(qp.C[equal]), kept(qp.C[~equal])

    def solve() -> Answer:
        solver = make()
        solver.settings.eps_abs = solver.settings.eps_rel = TOLERANCE
        solver.setup(P, qp.q, A, qp.low[equal], G, qp.low[~equal], qp.up[~equal])
        status, ms = _timed(solver.solve)
        result = solver.result
        y = np.zeros(qp.low.size)
        y[equal] = result.y
        y[~equal] = np.asarray(result.z_u) - np.asarray(result.z_l)
        return Answer(np.array(result.x), y, ms, "" if "SOLVED" in str(status) else str(status))

    return solve


def osqp(task: Task) -> Solve:
    """OSQP, sparse."""
    import osqp as peer
    from scipy import sparse

    qp = task.general

    def solve() -> Answer:
        solver = peer.OSQP()
        solver.setup(
            sparse.csc_matrix(np.triu(qp.P)), qp.q, sparse.csc_matrix(qp.C), qp.low, qp.up,
            eps_abs=TOLERANCE, eps_rel=TOLERANCE, max_iter=20000, polishing=False, verbose=False,
        )  # fmt: skip
        result, ms = _timed(solver.solve)
        failure = "" if result.info.status.startswith("solved") else result.info.status
        return Answer(result.x, result.y, ms, failure)

    return solve


def proxqp(task: Task) -> Solve:
    """ProxQP, dense."""
    from proxsuite import proxqp as peer

    qp, equal = task.general, task.general.is_equality

    def solve() -> Answer:
        solver = peer.dense.QP(qp.q.size, int(equal.sum()), int((~equal).sum()))
        solver.settings.eps_abs, solver.settings.eps_rel = TOLERANCE, 0.0
        bounds = [np.clip(v[~equal], -1e20, 1e20) for v in (qp.low, qp.up)]
        solver.init(qp.P, qp.q, qp.C[equal], qp.low[equal], qp.C[~equal], *bounds)
        _, ms = _timed(solver.solve)
        y = np.zeros(qp.low.size)
        y[equal], y[~equal] = solver.results.y, solver.results.z
        status = str(solver.results.info.status)
        return Answer(solver.results.x, y, ms, "" if status.endswith("_SOLVED") else status)

    return solve


def daqp(task: Task) -> Solve:
    """DAQP, dense; its set-up is part of its one call."""
    import daqp as peer

    qp, equal = task.general, task.general.is_equality
    kind = np.where(equal, 5, 0).astype(np.int32)  # 5: an equality
    low, up = (np.clip(v, -1e30, 1e30) for v in (qp.low, qp.up))

    def solve() -> Answer:
        arguments = [np.ascontiguousarray(v, float) for v in (qp.P, qp.q, qp.C, up, low)]
        (x, _, flag, info), ms = _timed(lambda: peer.solve(*arguments, kind))
        return Answer(
            np.asarray(x), np.asarray(info["lam"]), ms, "" if flag > 0 else f"flag {flag}"
        )

    return solve


def hpipm(task: Task) -> Solve:
    """HPIPM in CasADi's wheel, by stages.

    Multipliers are found anew, by least squares over the rows at their bounds: those of an equality
    come as the difference of two large ones, with an error that is not HPIPM's.
    """
    qp, knots = task.general, task.staged.knots
    sign = np.ones(qp.low.size)  # CasADi wants F(x, u) - x_next = -b
    at = 0
    for knot in knots:
        sign[at : at + knot.b.size] = -1.0
        at += knot.b.size + knot.low.size
    C = ca.sparsify(ca.DM(sign[:, None] * qp.C))
    low, up = np.minimum(sign * qp.low, sign * qp.up), np.maximum(sign * qp.low, sign * qp.up)
    P = ca.sparsify(ca.DM(qp.P))
    sizes = {
        "N": len(knots) - 1, "nx": [k.nx for k in knots], "nu": [k.nu for k in knots],
        "ng": [k.low.size for k in knots],
    }  # fmt: skip
    options: dict[str, Any] = {
        "print_time": False,
        "error_on_fail": False,
        "hpipm": {"mode": "speed_abs"},
    }
    solver = ca.conic("peer", "hpipm", {"h": P.sparsity(), "a": C.sparsity()}, options | sizes)

    def solve() -> Answer:
        result, ms = _timed(lambda: solver(h=P, g=qp.q, a=C, lba=low, uba=up))
        failure = "" if solver.stats()["success"] else str(solver.stats()["return_status"])
        x = np.asarray(result["x"]).ravel()
        return Answer(x, _multipliers(qp, x), ms, failure)

    return solve


def _multipliers(qp: GeneralQp, x: Array) -> Array:
    y, rows = np.zeros(qp.low.size), qp.C @ x
    scale = 1e-6 * (1.0 + np.abs(rows))
    at_up, at_low = qp.up - rows <= scale, rows - qp.low <= scale
    active = at_up | at_low
    y[active] = np.linalg.lstsq(qp.C[active].T, -(qp.P @ x + qp.q), rcond=None)[0]
    y[~at_low & (y < 0)] = 0.0
    y[~at_up & (y > 0)] = 0.0
    return y


def _nothing(task: Task) -> tuple[Array, Array]:
    qp = task.general
    return np.full(qp.q.size, np.nan), np.full(qp.low.size, np.nan)


_PACKAGES: Mapping[str, tuple[Solver, tuple[str, ...]]] = {
    "structured": (structured, ()),
    "piqp": (piqp, ("piqp",)),
    "piqp-sparse": (piqp_sparse, ("piqp", "scipy")),
    "osqp": (osqp, ("osqp", "scipy")),
    "proxqp": (proxqp, ("proxsuite",)),
    "daqp": (daqp, ("daqp",)),
    "hpipm": (hpipm, ()),
}
NAMES = tuple(_PACKAGES)


def installed() -> dict[str, Solver]:
    """Those whose packages are there."""
    return {
        name: solver
        for name, (solver, packages) in _PACKAGES.items()
        if all(importlib.util.find_spec(package) for package in packages)
        and (name != "hpipm" or ca.has_conic("hpipm"))
    }
