"""acados with HPIPM, from an environment of its own.

`comma-deps-acados` brings a CasADi of its own, so it must not be installed beside ours. Its Python
code works with our CasADi all the same; so that its libraries do not meet those of our CasADi
wheel it runs in a process of its own, which is told a problem's number and answers in JSON.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from palanquin.benchmarks.peers.ocp_peers import Judge
from palanquin.benchmarks.peers.outcome import Outcome
from palanquin.benchmarks.variant import Task
from palanquin.errors import ProblemError


def find_acados(environment: Path) -> Path:
    """Folder of the package in a virtual environment; raises ProblemError if it isn't there."""
    found = sorted(environment.glob("lib/python*/site-packages/acados/acados_template"))
    if not found:
        raise ProblemError(
            f"--acados {environment}: no acados there; make a virtual environment and "
            "`pip install comma-deps-acados` in it"
        )
    return found[0].parent.absolute()


class AcadosPeer:
    """acados' SQP with full steps; generating and compiling its code takes a minute or two."""

    label = "acados: SQP, HPIPM"

    def __init__(
        self, package: Path, task: Task, count: int, seed: int, judge: Judge, folder: Path
    ) -> None:
        self.columns: dict[str, Any] = {
            "solver": "acados-sqp",
            "qp": "acados-hpipm",
            "form": "reduced",
        }
        self._judge = judge
        start = time.perf_counter()
        arguments = [package, folder, task.robots, task.horizon, count, seed]
        self._log = folder / "acados.log"
        self._process = subprocess.Popen(
            [sys.executable, "-m", "palanquin.benchmarks.peers.acados_worker",
             *map(str, arguments)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._log.open("w"), text=True,
            env=_environment(package),
        )  # fmt: skip
        self._read()
        self.setup_ms = 1e3 * (time.perf_counter() - start)

    def solve(self, index: int) -> Outcome:
        """From the instance's guess to convergence."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{index}\n")
        self._process.stdin.flush()
        answer = self._read()
        failure = "" if answer["status"] == 0 else f"status {answer['status']}"
        return self._judge.outcome(
            index, np.array(answer["trajectory"]), answer["ms"], answer["iterations"], failure
        )

    def close(self) -> None:
        """Ends the process."""
        self._process.communicate()

    def _read(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"acados' process has ended; {self._log} says why")
        return json.loads(line)


def _environment(package: Path) -> dict[str, str]:
    install = package / "install"
    return {
        **os.environ,
        "ACADOS_SOURCE_DIR": str(install),
        "ACADOS_PYTHON_INTERFACE_PATH": str(package / "acados_template"),
        "TERA_PATH": str(install / "bin" / "t_renderer"),
        "LD_LIBRARY_PATH": str(install / "lib"),
    }
