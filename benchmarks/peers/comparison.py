"""`palanquin bench peers`: the same problems by what else can be installed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
from rich.console import Console
from rich.table import Table

from palanquin.benchmarks.machine import describe_machine, source_revision
from palanquin.benchmarks.peers.acados_peer import AcadosPeer, find_acados
from palanquin.benchmarks.peers.instance import make_instances
from palanquin.benchmarks.peers.ocp_peers import OWN_SOLVERS, CasadiPeer, Judge, OwnPeer
from palanquin.benchmarks.peers.outcome import Peer, Row, ask, make_rows
from palanquin.benchmarks.peers.qp_peers import CasadiQpPeer, OwnQpPeer, StepQps
from palanquin.benchmarks.tables import print_limitations, print_machine
from palanquin.benchmarks.trot import build_problem
from palanquin.benchmarks.variant import Task

LIMITATIONS = (
    "One sequence of contacts, cold starts from the references; every peer gets the same "
    "penalties. Interior-point methods are at their best with hard inequalities instead.",
    "CasADi evaluates Ipopt's and fatrop's functions in its virtual machine, with exact Hessians; "
    "ours and acados' are compiled, with Gauss-Newton ones. Set-up is stated apart.",
    "HPIPM and BLASFEO in CasADi's wheel are built for any x86-64 processor; a build for this "
    "one is some 4 to 6 times faster. acados has its own.",
    "Stopping tests differ: compare times together with cost + (largest relative excess over the "
    "best answer) and residual (largest violation of an equality), both computed by us.",
)


def run_peers(
    task: Task,
    count: int,
    seed: int,
    folder: Path,
    acados: Path | None = None,
    announce: Callable[[str], None] = lambda text: None,
) -> dict[str, Any]:
    """Measures all peers that are installed; returns {"rows", "machine", "revision"}.

    Args:
        task: without ditches.
        count: how many problems.
        seed: of the disturbed starts.
        folder: for code that peers generate.
        acados: a virtual environment that has it; skipped without.
        announce: told what is being done.
    """
    folder.mkdir(parents=True, exist_ok=True)
    package = find_acados(acados) if acados else None
    machine, revision = describe_machine(), source_revision()
    announce("lowering")
    problem = build_problem(task)
    lowered = problem.lower()
    instances = make_instances(lowered, task, count, seed)
    judge = Judge(lowered, instances)
    common = {
        "robots": task.robots, "horizon": task.horizon, "ditches": 0, "start": "cold", "threads": 1,
    }  # fmt: skip

    peers: list[Peer] = [OwnPeer(lowered, instances, judge, by) for by in OWN_SOLVERS]
    for plugin in ("ipopt", "fatrop"):
        if ca.has_nlpsol(plugin):
            announce(f"setting up CasADi with {plugin}")
            peers.append(CasadiPeer(plugin, problem, instances, judge))
    if package is not None:
        announce("setting up acados: generating and compiling its code")
        peers.append(AcadosPeer(package, task, count, seed, judge, folder))
    announce("solving whole problems")
    rows = make_rows("ocp", peers, ask(peers, count), common)
    if isinstance(peers[-1], AcadosPeer):
        peers[-1].close()

    announce("solving QPs")
    reduced, paper = (StepQps(lowered, form, instances) for form in ("reduced", "paper"))
    rows += _qp_rows(reduced, ("structured", "ldl", "osqp"), ("osqp", "hpipm"), count, common)
    rows += _qp_rows(paper, ("ldl", "osqp"), ("osqp",), count, common)
    return {"rows": rows, "machine": machine, "revision": revision}


def _qp_rows(
    qps: StepQps, own: tuple[str, ...], plugins: tuple[str, ...], count: int, common: Row
) -> list[Row]:
    peers: list[Peer] = [OwnQpPeer(name, qps) for name in own]
    peers += [CasadiQpPeer(plugin, qps) for plugin in plugins if ca.has_conic(plugin)]
    return make_rows("qp", peers, ask(peers, count, repeat=3), common)


def report_peers(results: dict[str, Any], folder: Path, console: Console) -> list[Path]:
    """Prints the tables; there are no pictures."""
    rows = results["rows"]
    size = f"R = {rows[0]['robots']}, N = {rows[0]['horizon']}"
    whole = [row for row in rows if row["problem"] == "ocp"]
    console.print(_table(f"Whole problems to convergence, {size}, ms", whole))
    qps = [row for row in rows if row["problem"] == "qp"]
    console.print(_table(f"The first step's QP, {size}, ms", qps))
    print_machine(console, results["machine"], results["revision"])
    print_limitations(console, LIMITATIONS)
    return []


def _table(title: str, rows: list[Row]) -> Table:
    table = Table(title=title, box=None, padding=(0, 1, 0, 0))
    table.add_column("peer", no_wrap=True)
    for name in ("p50", "max", "iter.", "cost +", "residual", "set-up", "failed"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in rows:
        if row["solve_ms"] is None:
            table.add_row(row["peer"], "failed:", row["error"])
            continue
        excess = row["cost_excess"]
        table.add_row(
            row["peer"],
            *(f"{row['solve_ms'][q]:.3g}" for q in ("p50", "max")),
            "" if row["iterations"] is None else f"{row['iterations']:.0f}",
            "" if excess is None else f"{excess:.1e}",
            f"{row['residual']:.1e}",
            f"{row['setup_ms']:.0f}",
            f"{row['failed_steps']}/{row['steps']}" if row["failed_steps"] else "",
        )
    return table
