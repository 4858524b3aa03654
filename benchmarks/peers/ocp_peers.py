"""Solvers of the whole problem: our own, and CasADi with Ipopt and with fatrop."""

from __future__ import annotations

import time
from typing import Any

import casadi as ca
import numpy as np

from palanquin.benchmarks.peers.instance import Instance
from palanquin.benchmarks.peers.outcome import Outcome
from palanquin.benchmarks.peers.stage_nlp import StageNlp, build_stage_nlp
from palanquin.benchmarks.variant import Solver
from palanquin.lowered import Lowered
from palanquin.plan import Ipopt, Plan, Sqp
from palanquin.problem import Problem

# Where everybody may stop: relative change of the cost for the SQP, optimality for the others.
TOLERANCE = 1e-6


class Judge:
    """Cost and equality residual of any trajectory, by our own functions on the paper's form."""

    def __init__(self, lowered: Lowered, instances: list[Instance]) -> None:
        self._lowered = lowered
        self._instances = instances

    def outcome(
        self,
        index: int,
        trajectory: np.ndarray,
        milliseconds: float,
        iterations: int,
        failure: str = "",
    ) -> Outcome:
        """What is to be said about an answer [N + 1, nz] to problem number `index`."""
        instance = self._instances[index]
        at = self._lowered.evaluate(trajectory, instance.params, instance.measured, form="paper")
        return Outcome(milliseconds, iterations, at.cost, at.equality_violation, failure)


class OwnPeer:
    """Palanquin's SQP with a QP back end, or its Ipopt on the penalised problem."""

    def __init__(
        self, lowered: Lowered, instances: list[Instance], judge: Judge, by: Solver | None
    ) -> None:
        self.columns: dict[str, Any] = {
            "solver": "sqp" if by else "ipopt",
            "qp": None,
            "form": "paper",
        }
        start = time.perf_counter()
        if by is None:
            self.label = "palanquin: Ipopt"
            self._solver: Sqp | Ipopt = Ipopt(lowered, tolerance=TOLERANCE, penalize=True)
        else:
            self.label = f"palanquin: {by.label}"
            self.columns |= {"qp": by.qp, "form": by.form}
            self._solver = Sqp(
                lowered,
                qp=by.qp,
                form=by.form,
                cost_tolerance=TOLERANCE,
                equality_tolerance=TOLERANCE,
                subproblem={"max_inner_iterations": by.max_qps},
            )
        self.setup_ms = 1e3 * (time.perf_counter() - start)
        self._instances = instances
        self._judge = judge

    def solve(self, index: int) -> Outcome:
        """From the instance's guess to convergence."""
        i = self._instances[index]
        start = time.perf_counter()
        plan: Plan = self._solver.solve(i.params, i.measured, i.guess)
        elapsed = 1e3 * (time.perf_counter() - start)
        failure = "" if plan.status.name == "CONVERGED" else plan.message
        return self._judge.outcome(index, plan.xs, elapsed, plan.iteration_count, failure)


class CasadiPeer:
    """`casadi.nlpsol` on the whole problem, with exact Hessians in CasADi's virtual machine."""

    def __init__(
        self, plugin: str, problem: Problem, instances: list[Instance], judge: Judge
    ) -> None:
        self.label = f"CasADi: {plugin}"
        self.columns: dict[str, Any] = {"solver": f"casadi-{plugin}", "qp": None, "form": "paper"}
        start = time.perf_counter()
        self._nlp = build_stage_nlp(problem, instances[0], carry=plugin == "fatrop")
        self._solver = ca.nlpsol("peer", plugin, self._nlp.nlp, nlpsol_options(plugin, self._nlp))
        self.setup_ms = 1e3 * (time.perf_counter() - start)
        self._instances = instances
        self._judge = judge

    def solve(self, index: int) -> Outcome:
        """From the instance's guess to convergence."""
        instance = self._instances[index]
        w, p = self._nlp.start(instance), self._nlp.parameters(instance)
        start = time.perf_counter()
        answer = self._solver(x0=w, p=p, lbg=self._nlp.lower, ubg=0)
        elapsed = 1e3 * (time.perf_counter() - start)
        stats = self._solver.stats()
        trajectory = self._nlp.trajectory(np.asarray(answer["x"]).ravel(), instance)
        failure = "" if stats["success"] else str(stats["return_status"])
        return self._judge.outcome(index, trajectory, elapsed, stats["iter_count"], failure)


def nlpsol_options(plugin: str, program: StageNlp, tolerance: float = TOLERANCE) -> dict[str, Any]:
    """Options of `casadi.nlpsol`: quiet, and for fatrop the program's stages."""
    own: dict[str, Any] = {"tol": tolerance, "print_level": 0}
    common = {"print_time": False, "error_on_fail": False, plugin: own}
    if plugin == "ipopt":
        own["sb"] = "yes"  # no banner
        return common
    return common | {
        "structure_detection": "manual",
        "N": len(program.nx) - 1,
        "nx": program.nx,
        "nu": program.nu,
        "ng": program.ng,
        "equality": program.equality,
    }


# None stands for our Ipopt.
OWN_SOLVERS = (
    Solver("structured", "reduced"),
    Solver("ldl", "reduced"),
    Solver("osqp", "paper"),
    Solver("osqp", "paper", max_qps=1),
    None,
)
