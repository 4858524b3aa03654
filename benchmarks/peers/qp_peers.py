"""Solvers of one QP: our back ends, and CasADi with OSQP and with HPIPM on the same matrices."""

from __future__ import annotations

import time
from typing import Any

import casadi as ca
import numpy as np

from palanquin import _core
from palanquin.benchmarks.peers.equality_qp import EqualityQp, equality_qp
from palanquin.benchmarks.peers.instance import Instance
from palanquin.benchmarks.peers.outcome import Outcome
from palanquin.benchmarks.variant import Form
from palanquin.lowered import Lowered

OSQP_TOLERANCE = 1e-5


class StepQps:
    """The QP of the first SQP step of each instance, penalties as quadratics at the guess."""

    def __init__(self, lowered: Lowered, form: Form, instances: list[Instance]) -> None:
        self.form = form
        self._lowered, self._qps = lowered, _core.StageQpSource()
        self._instances = instances
        self.matrices = [equality_qp(*self.at(i)) for i in range(len(instances))]

    def at(self, index: int) -> tuple[_core.StageQp, _core.PenaltyModel]:
        """QP number `index`, valid until the next call."""
        at = self._instances[index]
        qp = self._qps.at(self._lowered.snapshot(at.guess, at.params, at.measured, form=self.form))
        return qp, _core.PenaltyModel(qp)

    def outcome(
        self, index: int, x: np.ndarray, milliseconds: float, iterations: int | None, failure: str
    ) -> Outcome:
        """What is to be said about the point x."""
        qp = self.matrices[index]
        return Outcome(milliseconds, iterations, qp.cost(x), qp.residual(x), failure)


class OwnQpPeer:
    """One of our QP back ends, its pattern analysed before."""

    def __init__(self, name: str, qps: StepQps) -> None:
        self.label = f"palanquin: {name} {qps.form}"
        self.columns: dict[str, Any] = {"solver": "qp", "qp": name, "form": qps.form}
        start = time.perf_counter()
        self._solver = _core.make_qp_solver(name)
        self.setup_ms = 1e3 * (time.perf_counter() - start)
        self._qps = qps

    def solve(self, index: int) -> Outcome:
        """From the origin."""
        qp, model = self._qps.at(index)
        solution = _core.StageQpSolution(qp)
        status = self._solver.solve(qp, model, solution)
        elapsed = self._solver.update_ms + self._solver.solve_ms
        x = np.concatenate(solution.w)[qp.stage(0).nx :]
        failure = "" if status == "solved" else status
        return self._qps.outcome(index, x, elapsed, None, failure)


class CasadiQpPeer:
    """`casadi.conic` on the same matrices."""

    def __init__(self, plugin: str, qps: StepQps) -> None:
        self.label = f"CasADi: {plugin} {qps.form}"
        self.columns: dict[str, Any] = {"solver": "qp", "qp": f"casadi-{plugin}", "form": qps.form}
        first = qps.matrices[0]
        sparsity = {"h": first.H.sparsity(), "a": first.A.sparsity()}
        start = time.perf_counter()
        self._solver = ca.conic("peer", plugin, sparsity, _options(plugin, first))
        self.setup_ms = 1e3 * (time.perf_counter() - start)
        self._qps = qps

    def solve(self, index: int) -> Outcome:
        """From the origin."""
        qp = self._qps.matrices[index]
        first = self._qps.matrices[0]
        H, A = ca.project(qp.H, first.H.sparsity()), ca.project(qp.A, first.A.sparsity())
        start = time.perf_counter()
        answer = self._solver(h=H, g=qp.g, a=A, lba=qp.b, uba=qp.b)
        elapsed = 1e3 * (time.perf_counter() - start)
        stats = self._solver.stats()
        failure = "" if stats["success"] else str(stats["return_status"])
        iterations = stats["iter_count"] if stats["iter_count"] >= 0 else None
        x = np.asarray(answer["x"]).ravel()
        return self._qps.outcome(index, x, elapsed, iterations, failure)


def _options(plugin: str, qp: EqualityQp) -> dict[str, Any]:
    common = {"print_time": False, "error_on_fail": False}
    if plugin == "osqp":
        tolerance = {"eps_abs": OSQP_TOLERANCE, "eps_rel": OSQP_TOLERANCE}
        return common | {"osqp": {"verbose": False, **tolerance}}
    # In its default mode HPIPM goes on until its iterations are used up, for accuracy that
    # rounding does not allow here.
    sizes = {"N": len(qp.nx) - 1, "nx": qp.nx, "nu": qp.nu, "ng": qp.ng}
    return common | sizes | {"hpipm": {"mode": "speed_abs"}}
