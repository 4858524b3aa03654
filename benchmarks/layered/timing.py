"""How long the layered planners take, and other solvers on the same QPs."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, cast

import casadi as ca
import numpy as np

from palanquin import _core
from palanquin.benchmarks.layered.runs import reduced_loop
from palanquin.benchmarks.peers.equality_qp import equality_qp
from palanquin.problems.layered import DistributedPlanner, Planner
from palanquin.problems.layered.bar_planner import BarPlanner
from palanquin.problems.layered.centralized import CentralizedPlanner
from palanquin.problems.layered.linear_mpc import LinearMpc
from palanquin.problems.layered.settings import WORKING
from palanquin.sim.runs.loop import Loop
from palanquin.sim.runs.run_outcome import percentiles
from palanquin.sim.scenarios.bar_planners import KINDS

# Kim et al., V-A.3, on an i7-10750H at 2.60 GHz; the nominal planner's time is not given.
PAPER_MS = {"centralized": 1.38, "distributed": 0.41}
PEERS = ("piqp", "osqp", "proxqp", "daqp")


@dataclass
class Times:
    """Milliseconds of one variant, sample by sample."""

    build: list[float] = field(default_factory=list)
    solve: list[float] = field(default_factory=list)
    total: list[float] = field(default_factory=list)
    failures: int = 0


@dataclass(frozen=True)
class Row:
    """One variant: `planner`, the QP's `solver`, quantiles of its phases, and how well it did.

    For the distributed planner all times are one robot's: the robots' processors work side by side.
    """

    planner: str
    solver: str
    times: Times
    cost_gap: float | None = None
    note: str = ""

    def to_json(self) -> dict[str, Any]:
        """Quantiles in ms."""
        phases = {
            f"{name}_ms": percentiles(values)
            for name, values in vars(self.times).items()
            if name != "failures" and values
        }
        return {
            "planner": self.planner, "solver": self.solver, **phases,
            "samples": len(self.times.solve), "failures": self.times.failures,
            "cost_gap": self.cost_gap, "note": self.note,
        }  # fmt: skip


def _busy(planner: str, samples: int, **options: Any) -> tuple[Loop, Any]:
    """A trot with an unknown payload and 40 N sinusoids, so that some rows are active, and its
    planner.
    """
    loop = reduced_loop("busy", samples * WORKING.dt, planner, **options)
    return loop, cast(BarPlanner, loop.planner).planner


def measure_planners(samples: int, solvers: tuple[str, ...] = ("structured",)) -> Iterator[Row]:
    """Every planner in closed loop, as it runs."""
    for name in KINDS:
        for solver in solvers:
            loop, planner = _busy(name, samples, qp=solver)
            times = Times()
            for tick in islice(loop.ticks(), samples):
                _add_plan(planner, times, tick.plan.solve_ms)
            times.failures = len(planner.events)
            yield Row(name, f"{solver} (in the loop)", times)


def _add_plan(planner: Planner, times: Times, total: float) -> None:
    if isinstance(planner, DistributedPlanner):
        for mpc, milliseconds in zip(planner.problems, planner.local_ms, strict=True):
            _add(times, mpc, milliseconds)
    elif isinstance(planner, CentralizedPlanner):
        _add(times, planner.mpc, total)


def _add(times: Times, mpc: LinearMpc, total: float) -> None:
    phases = mpc.sqp.times_ms
    times.build.append(phases.linearize)
    times.solve.append(phases.update + phases.solve)
    times.total.append(total)


@dataclass(frozen=True)
class Instance:
    """A QP of the walk: what `casadi.conic` takes, and our solution's cost."""

    H: ca.DM
    g: np.ndarray
    A: ca.DM
    lower: np.ndarray
    upper: np.ndarray
    cost: float

    def cost_of(self, x: np.ndarray) -> float:
        """Objective at x."""
        return float(0.5 * x @ np.asarray(self.H @ x).ravel() + self.g @ x)


def measure_peers(samples: int) -> Iterator[Row]:
    """Other solvers, from their default starts, on QPs of the walk; each only if it is there."""
    for name in ("centralized", "distributed"):
        instances = _instances(name, samples)
        for peer in PEERS:
            yield _measure_peer(name, peer, instances)


def _instances(planner: str, samples: int) -> list[Instance]:
    """QPs of a closed loop of one trot cycle, evenly spread."""
    found: list[Instance] = []
    cycle, ticks = 80, 200
    loop, mpcs = _busy(planner, ticks)
    for count, _ in enumerate(islice(loop.ticks(), ticks), start=1):
        if count > cycle and count % max(1, cycle // samples) == 0 and len(found) < samples:
            found.append(_instance(mpcs.problems[0]))
    return found


def _instance(mpc: LinearMpc) -> Instance:
    qp = mpc.linearise()
    model = _core.PenaltyModel(qp)
    flat = equality_qp(qp, model)
    stages = [qp.stage(k) for k in range(qp.horizon + 1)]
    first, known = np.cumsum([0, *(s.nw for s in stages)]), stages[0].nx
    whole = np.zeros((sum(len(s.inequality_value) for s in stages), first[-1]))
    upper, row = np.zeros(len(whole)), 0
    for k, stage in enumerate(stages):
        n = len(stage.inequality_value)
        whole[row : row + n, first[k] : first[k + 1]] = stage.inequality_jacobian
        upper[row : row + n] = -stage.inequality_value
        row += n
    upper -= whole[:, :known] @ qp.initial_state
    A = ca.vertcat(flat.A, ca.sparsify(ca.DM(whole[:, known:])))
    solution = _core.StageQpSolution(qp)
    _core.make_qp_solver("structured").solve(qp, model, solution)
    x = np.concatenate(solution.w)[known:]
    lower = np.concatenate([flat.b, np.full(len(upper), -np.inf)])
    return Instance(flat.H, flat.g, A, lower, np.concatenate([flat.b, upper]), flat.cost(x))


def _measure_peer(planner: str, peer: str, instances: list[Instance]) -> Row:
    times, gaps = Times(), []
    for qp in instances:
        try:
            solver = ca.conic(
                "peer", peer, {"h": qp.H.sparsity(), "a": qp.A.sparsity()}, _options(peer, qp)
            )
        except RuntimeError as error:
            return Row(planner, f"{peer} (CasADi)", times, note=str(error).splitlines()[-1][:80])
        elapsed = []
        for _ in range(5):
            start = clock.perf_counter()
            answer = solver(h=qp.H, g=qp.g, a=qp.A, lba=qp.lower, uba=qp.upper)
            elapsed.append(1e3 * (clock.perf_counter() - start))
        gap = abs(qp.cost_of(np.asarray(answer["x"]).ravel()) - qp.cost)
        if not solver.stats()["success"] or not np.isfinite(gap):
            times.failures += 1
            continue
        times.solve.append(min(elapsed))
        gaps.append(gap / max(1.0, abs(qp.cost)))
    return Row(planner, f"{peer} (CasADi)", times, float(np.max(gaps)) if gaps else None)


def _options(peer: str, qp: Instance) -> dict[str, Any]:
    common: dict[str, Any] = {"print_time": False, "error_on_fail": False}
    if peer == "osqp":
        tolerances = {"eps_abs": 1e-5, "eps_rel": 1e-5, "max_iter": 20000}
        return common | {"osqp": {"verbose": False, **tolerances}}
    return common
