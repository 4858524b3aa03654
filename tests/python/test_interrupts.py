"""Ctrl-C ends what runs: exit status 130, no traceback, and what is done is kept."""

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

import palanquin as pq
from palanquin.sim.runs.campaign import Trial
from palanquin.sim.runs.store import RowStore

PALANQUIN = Path(sys.executable).with_name("palanquin")
CASES = Path(__file__).parents[1] / "data" / "cases"

# Runs a command of the package and sends itself what a terminal sends on Ctrl-C, as soon as the
# function is called in which the command spends its time.
INTERRUPTED = """
import importlib, os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
module, name = sys.argv[1].rsplit(".", 1)
owner = importlib.import_module(module)
original = getattr(owner, name)
def interrupted(*arguments, **options):
    os.kill(os.getpid(), signal.SIGINT)
    return original(*arguments, **options)
setattr(owner, name, interrupted)
from palanquin.cli import app
app(sys.argv[2:])
"""


@pytest.fixture(autouse=True)
def interruptible():
    """Jobs in the background of a shell start with interrupts ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def interrupted(where, *arguments, cwd):
    command = [sys.executable, "-c", INTERRUPTED, where, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=cwd)


@pytest.mark.parametrize(
    ("where", "arguments"),
    [
        ("palanquin.problems.clm.solve.solve_case", ["solve", CASES / "stand.json"]),
        ("palanquin.sim.runs.nominal.nominal_step", ["demo", "trot", "--tracking", "kinematic"]),
        ("palanquin.sim.runs.hands_physics.targets", ["demo", "trot", "--no-video"]),
        ("palanquin.sim.runs.scenarios.PhysicsPlant", ["demo", "bar", "--no-video"]),
        ("palanquin.sim.runs.campaign.as_completed", ["campaign", "bar", "--seeds", "2"]),
        ("palanquin.benchmarks.measurement.take_turns", ["bench", "solver", "--quick"]),
        ("palanquin.sim.feasibility.findings", ["scenario", "check", "trot"]),
    ],
)
def test_a_command_says_that_it_was_stopped(where, arguments, tmp_path):
    result = interrupted(where, *arguments, cwd=tmp_path)
    assert result.returncode == 130, result.stderr
    assert "stopped" in result.stderr
    assert "Traceback" not in result.stderr


def test_a_stopped_campaign_goes_on(tmp_path):
    file = tmp_path / "runs.jsonl"
    row = {"suite": "flat", "planner": "nominal", "seed": 1}
    RowStore(file, {}, resume=True).add(Trial(**row).key, row)
    options = ["--planners", "nominal", "--seeds", "3", "--jobs", "2", "--json", file]
    where = "palanquin.sim.runs.campaign.as_completed"
    result = interrupted(where, "campaign", "bar", *options, cwd=tmp_path)
    assert result.returncode == 130, result.stderr
    assert RowStore(file, {}, resume=True).rows == [row]


SOLVERS = {
    "ipopt": lambda problem: pq.Ipopt(problem, tolerance=1e-300),
    "osqp": lambda problem: pq.Sqp(problem, qp="osqp"),
}


def solve_for_ever(solver, params, measured):
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
    while True:
        solver.solve(params, measured)


def test_a_long_solve_is_stopped_within(lowered):
    problem = lowered("Hopper")
    horizon = 50_000
    params, measured = problem.parameters(horizon), problem.knot()
    solver = pq.Sqp(problem, horizon=horizon, cost_tolerance=1e-300, stationarity_tolerance=1e-300)
    with pytest.raises(KeyboardInterrupt):
        solve_for_ever(solver, params, measured)
    assert solver.message.startswith("the solve was stopped after")


@pytest.mark.parametrize("name", SOLVERS)
def test_a_solver_is_usable_after_an_interrupt(lowered, name):
    problem = lowered("Hopper")
    params, measured = problem.parameters(), problem.knot()
    solver = SOLVERS[name](problem)
    with pytest.raises(KeyboardInterrupt):
        solve_for_ever(solver, params, measured)
    first, again = (solver.solve(params, measured) for _ in range(2))
    assert first.status == again.status
    assert first.cost == pytest.approx(again.cost, rel=1e-6)
