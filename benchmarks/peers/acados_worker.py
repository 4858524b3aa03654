"""The process in which acados runs; see `acados_peer`.

Arguments: acados' package folder, a folder for its code, robots, intervals, number of problems,
seed. When ready it writes one line, then a line of JSON for each number that it reads.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from palanquin.benchmarks.peers.acados_stage import Stage, build_stage
from palanquin.benchmarks.peers.instance import Instance, linked_blocks, make_instances
from palanquin.benchmarks.peers.ocp_peers import TOLERANCE
from palanquin.benchmarks.trot import build_problem
from palanquin.benchmarks.variant import Task
from palanquin.problem import Block, Problem


class Worker:
    """acados' solver of the task."""

    def __init__(self, package: Path, folder: Path, task: Task, count: int, seed: int) -> None:
        problem = build_problem(task)
        self._instances = make_instances(problem.lower(), task, count, seed)
        kept = linked_blocks(problem, self._instances[0])
        stage = build_stage(problem, kept)
        self._columns = _columns(problem, kept)
        self._knot = ca.Function("knot", [stage.s, stage.u, stage.p], [stage.z])
        self._horizon = task.horizon
        self._solver = _make_solver(package, folder, stage, task.horizon)

    def solve(self, index: int) -> dict[str, Any]:
        """From the instance's guess, full steps until the tolerance is met."""
        self._load(self._instances[index])
        start = time.perf_counter()
        status = self._solver.solve()
        elapsed = 1e3 * (time.perf_counter() - start)
        return {
            "status": int(status),
            "ms": elapsed,
            "iterations": int(np.ravel(self._solver.get_stats("sqp_iter"))[0]),
            "trajectory": self._trajectory(self._instances[index]).tolist(),
        }

    def _load(self, instance: Instance) -> None:
        states, inputs, kept = self._columns
        z, measured = instance.guess.values, instance.measured.values
        initial = np.concatenate([measured[states], measured[kept]])
        for k in range(self._horizon + 1):
            previous = z[k - 1] if k else measured
            self._solver.set(k, "p", instance.params.values[k])
            self._solver.set(k, "x", np.concatenate([z[k, states], previous[kept]]))
            if k < self._horizon:
                self._solver.set(k, "u", z[k, inputs])
        self._solver.set(0, "lbx", initial)
        self._solver.set(0, "ubx", initial)

    def _trajectory(self, instance: Instance) -> np.ndarray:
        z = instance.guess.values.copy()
        states, _, _ = self._columns
        for k in range(self._horizon):
            s, u = self._solver.get(k, "x"), self._solver.get(k, "u")
            z[k] = np.asarray(self._knot(s, u, instance.params.values[k])).ravel()
        z[-1, states] = self._solver.get(self._horizon, "x")[: len(states)]
        return z


def _columns(problem: Problem, kept: list[Block]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Columns of the knot vector: states, all others, and those of the `kept` blocks."""
    names = {b.name for b in kept}
    states: list[int] = []
    inputs: list[int] = []
    carried: list[int] = []
    offset = 0
    for b in problem.blocks:
        own = range(offset, offset + b.size)
        (states if b.is_state else inputs).extend(own)
        if b.name in names:
            carried.extend(own)
        offset += b.size
    return np.array(states), np.array(inputs), np.array(carried)


def _make_solver(package: Path, folder: Path, stage: Stage, horizon: int) -> Any:
    sys.path.append(str(package))
    from acados_template import AcadosModel, AcadosOcp, AcadosOcpSolver

    model = AcadosModel()
    model.name = "clm"
    model.x, model.u, model.p = stage.s, stage.u, stage.p
    model.disc_dyn_expr = stage.following
    model.cost_expr_ext_cost = stage.cost
    model.cost_expr_ext_cost_custom_hess = stage.hessian
    model.cost_expr_ext_cost_e = stage.terminal_cost
    model.cost_expr_ext_cost_custom_hess_e = stage.terminal_hessian
    ocp = AcadosOcp()
    ocp.model = model
    ocp.dims.N = horizon
    ocp.parameter_values = np.zeros(stage.p.numel())
    ocp.cost.cost_type = ocp.cost.cost_type_e = "EXTERNAL"
    ocp.constraints.x0 = np.zeros(stage.s.numel())
    options = ocp.solver_options
    options.tf = float(horizon)  # acados multiplies running costs by the interval's length
    options.integrator_type = "DISCRETE"
    options.nlp_solver_type = "SQP"
    options.hessian_approx = "GAUSS_NEWTON"
    options.qp_solver = "PARTIAL_CONDENSING_HPIPM"
    options.nlp_solver_max_iter = 50
    # Its test of stationarity is absolute, in the cost's own unit.
    options.nlp_solver_tol_stat = 1e2 * TOLERANCE
    options.nlp_solver_tol_eq = options.nlp_solver_tol_comp = TOLERANCE
    options.ext_fun_compile_flags = "-O2 -march=native"
    ocp.code_export_directory = str(folder / "acados")
    return AcadosOcpSolver(ocp, json_file=str(folder / "acados.json"))


def main() -> None:
    """Makes the solver and answers until there is no more input."""
    replies = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what acados and make print must not meet the replies
    package, folder = Path(sys.argv[1]), Path(sys.argv[2])
    robots, horizon, count, seed = map(int, sys.argv[3:])
    worker = Worker(package, folder, Task(robots, horizon), count, seed)
    print(json.dumps({"ready": True}), file=replies, flush=True)
    for line in sys.stdin:
        print(json.dumps(worker.solve(int(line))), file=replies, flush=True)


if __name__ == "__main__":
    main()
