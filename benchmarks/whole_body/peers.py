"""Our dual active-set solver and others on one recorded QP: each as its own interface suits it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from importlib import import_module
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palanquin import _sim
from palanquin.benchmarks.whole_body.recorded import RecordedQp

Array = NDArray[np.float64]

TOLERANCE = {"eps_abs": 1e-6, "eps_rel": 1e-9}
"""Asked of the iterative ones; ours tests stationarity by 1e-9 of the largest term itself."""

MOST_ITERATIONS = 200
"""After which they have failed: ProxQP would go on for seconds."""


class Peer(ABC):
    """A solver. `inside_us`: what its own clock, without Python, says of the last solve; or None.

    ImportError if it is not installed.
    """

    name: str
    inside_us: float | None = None

    @abstractmethod
    def prepare(self, qp: RecordedQp) -> None:
        """What depends on the sizes alone, and brings matrices into the order that it takes."""

    @abstractmethod
    def solve(self) -> Array | None:
        """The prepared QP from scratch; None for a failure."""

    def timed(self, repeats: int) -> tuple[Array | None, float, float | None]:
        """Solution, and least of some repeats of the call's and its own time, us."""
        calls, inside = [], []
        for _ in range(repeats):
            start = perf_counter()
            x = self.solve()
            calls.append(1e6 * (perf_counter() - start))
            inside.append(self.inside_us)
        own = None if inside[0] is None else min(t for t in inside if t is not None)
        return x, min(calls), own


class Own(Peer):
    """`DenseQpSolver`: Goldfarb and Idnani's dual active-set method."""

    name = "palanquin"

    def __init__(self) -> None:
        self._solver = _sim.DenseQpSolver()

    def prepare(self, qp: RecordedQp) -> None:
        self._qp = qp.own

    def solve(self) -> Array | None:
        is_solved = self._solver.solve(self._qp)
        self.inside_us = self._solver.microseconds
        return self._solver.solution if is_solved else None


class Daqp(Peer):
    """Arnstrom, Bemporad and Axehill's dual active-set solver."""

    name = "daqp"

    def __init__(self) -> None:
        self._daqp: Any = import_module("daqp")

    def prepare(self, qp: RecordedQp) -> None:
        rows = np.ascontiguousarray(np.vstack([qp.E, qp.C]))
        upper = np.concatenate([qp.limit, qp.e, np.full(len(qp.c), 1e30)])
        lower = np.concatenate([-qp.limit, qp.e, qp.c])
        sense = np.zeros(len(upper), dtype=np.int32)
        sense[len(qp.limit) :][: len(qp.e)] = 5  # an equality
        self._args = qp.H, qp.g, rows, upper, lower, sense

    def solve(self) -> Array | None:
        sense = self._args[-1].copy()
        x, _, flag, info = self._daqp.solve(*self._args[:-1], sense)
        self.inside_us = 1e6 * (info["setup_time"] + info["solve_time"])
        return np.asarray(x) if flag == 1 else None


class Quadprog(Peer):
    """The classical Fortran of Goldfarb and Idnani's method; it has no clock of its own."""

    name = "quadprog"

    def __init__(self) -> None:
        self._quadprog: Any = import_module("quadprog")

    def prepare(self, qp: RecordedQp) -> None:
        unit = np.eye(len(qp.limit), len(qp.g))
        rows = np.vstack([qp.E, unit, -unit, qp.C])
        bounds = np.concatenate([qp.e, -qp.limit, -qp.limit, qp.c])
        self._args = qp.H, -qp.g, np.asfortranarray(rows.T), bounds, len(qp.e)

    def solve(self) -> Array | None:
        try:
            return np.asarray(self._quadprog.solve_qp(*self._args)[0])
        except ValueError:  # inconsistent, or not positive definite
            return None


class Piqp(Peer):
    """Schwan et al.'s proximal interior-point method, dense."""

    name = "piqp"

    def __init__(self) -> None:
        self._piqp: Any = import_module("piqp")

    def prepare(self, qp: RecordedQp) -> None:
        free = np.full(len(qp.g) - len(qp.limit), np.inf)
        most = np.concatenate([qp.limit, free])
        order = np.asfortranarray
        self._data = {
            "P": order(qp.H), "c": qp.g, "A": order(qp.E), "b": qp.e, "G": order(qp.C),
            "h_l": qp.c, "h_u": np.full(len(qp.c), np.inf), "x_l": -most, "x_u": most,
        }  # fmt: skip
        self._solver = self._piqp.DenseSolver()
        self._solver.settings.verbose = False
        self._solver.settings.compute_timings = True
        self._solver.settings.max_iter = MOST_ITERATIONS
        for name, value in TOLERANCE.items():
            setattr(self._solver.settings, name, value)
        self._solver.setup(**self._data)

    def solve(self) -> Array | None:
        self._solver.update(**self._data)
        status = self._solver.solve()
        info = self._solver.result.info
        self.inside_us = 1e6 * (info.update_time + info.solve_time)
        is_solved = status == self._piqp.PIQP_SOLVED
        return np.array(self._solver.result.x) if is_solved else None


class ProxQp(Peer):
    """Bambade et al.'s proximal augmented Lagrangian, dense with a box, from a cold start."""

    name = "proxqp"

    def __init__(self) -> None:
        self._proxqp: Any = import_module("proxsuite").proxqp

    def prepare(self, qp: RecordedQp) -> None:
        dense = self._proxqp.dense
        n, free = len(qp.g), np.full(len(qp.g) - len(qp.limit), 1e20)
        most = np.concatenate([qp.limit, free])
        upper = np.full(len(qp.c), 1e20)
        self._data = qp.H, qp.g, qp.E, qp.e, qp.C, qp.c, upper, -most, most
        self._solver = dense.QP(n, len(qp.e), len(qp.c), True)
        settings = self._solver.settings
        settings.compute_timings, settings.max_iter = True, MOST_ITERATIONS
        settings.max_iter_in = MOST_ITERATIONS
        for name, value in TOLERANCE.items():
            setattr(settings, name, value)
        settings.initial_guess = self._proxqp.EQUALITY_CONSTRAINED_INITIAL_GUESS
        self._solver.init(*self._data)

    def solve(self) -> Array | None:
        self._solver.update(*self._data)
        self._solver.solve()
        results = self._solver.results
        self.inside_us = results.info.run_time
        is_solved = results.info.status == self._proxqp.PROXQP_SOLVED
        return np.array(results.x) if is_solved else None


PEERS: tuple[type[Peer], ...] = (Own, Daqp, Quadprog, Piqp, ProxQp)
