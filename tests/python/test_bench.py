"""`palanquin bench`: what its files hold, what it takes up again, what it says about bad input.

Nothing here looks at how long anything took.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console
from support.strict_json import strict_json
from typer.testing import CliRunner

from palanquin.benchmarks.measurement import Measurement
from palanquin.benchmarks.replay import Replay
from palanquin.benchmarks.rows import make_row
from palanquin.benchmarks.runs import Step
from palanquin.benchmarks.tables import (
    phase_table,
    slope,
    speedup,
    time_table,
    work_table,
)
from palanquin.benchmarks.trot import ClosedLoop, make_planner
from palanquin.benchmarks.turns import Record, take_turns
from palanquin.benchmarks.variant import PAPER_SOLVER, SOLVERS, Solver, Task, Variant
from palanquin.cli import app
from palanquin.plan import SQP_PHASES
from palanquin.sim.runs.run_outcome import percentiles

FIXED_KEYS = {
    "robots",
    "horizon",
    "solver",
    "qp",
    "form",
    "start",
    "threads",
    "solve_ms",
    "phases_ms",
}
STRUCTURED = Variant(Task(1, 3), SOLVERS[0])


@pytest.fixture(autouse=True)
def _cache(session_cache, monkeypatch):
    monkeypatch.setenv("PALANQUIN_CACHE", str(session_cache))


def bench(*arguments):
    return CliRunner().invoke(app, ["bench", *map(str, arguments)])


def tiny(name, folder, *arguments):
    result = bench(name, "--out", folder, "--repetitions", 2, *arguments)
    assert result.exit_code == 0, result.output
    return strict_json(folder / "results.json")


def step(milliseconds=1.0, failure="", qps=1):
    return Step({"update": 0.0, "solve": milliseconds}, milliseconds + 1, 2.0, 1, qps, failure)


# ---- runs --------------------------------------------------------------------------------------


def test_horizon_measures_every_solver_on_every_horizon(tmp_path):
    file = tmp_path / "figures.json"
    results = tiny("horizon", tmp_path / "out", "--robots", 1, "--horizons", "6,8", "--json", file)
    assert strict_json(file) == results
    assert set(results) == {"rows", "machine", "revision"}
    assert {"cpu", "cores", "engine_compiler", "kernels"} <= set(results["machine"])
    rows = results["rows"]
    assert [row["horizon"] for row in rows] == [6] * len(SOLVERS) + [8] * len(SOLVERS)
    for row in rows:
        assert set(row) >= FIXED_KEYS
        assert set(row["solve_ms"]) == {"p50", "p95", "p99", "max"}
        assert set(row["phases_ms"]) == set(SQP_PHASES)
        assert (row["steps"], row["failed_steps"], row["error"]) == (2, 0, None)
        assert (row["solver"], row["start"]) == ("rti", "warm")
        assert (row["mflop"] is not None) == (row["qp"] == "structured")
    assert (tmp_path / "out" / "rate-over-horizon.png").stat().st_size > 10_000


def test_back_ends_drive_the_loop_to_the_same_cost(tmp_path):
    rows = tiny("horizon", tmp_path, "--robots", 1, "--horizons", 3)["rows"]
    costs = {(row["qp"], row["form"]): row["cost"] for row in rows if row["max_qps"] > 1}
    exact = costs["structured", "reduced"]
    assert costs["ldl", "reduced"] == pytest.approx(exact, rel=1e-6)
    assert costs["ldl", "paper"] == pytest.approx(exact, rel=1e-3)
    assert costs["osqp", "reduced"] == pytest.approx(exact, rel=1e-3)
    assert costs["osqp", "paper"] == pytest.approx(exact, rel=1e-3)


def test_seeds_change_the_disturbances_and_nothing_else_does(tmp_path):
    arguments = ("--robots", 1, "--horizons", 3, "--qp", "structured")
    cost = [
        tiny("horizon", tmp_path, *arguments, "--seed", seed)["rows"][0]["cost"]
        for seed in (0, 0, 1)
    ]
    assert cost[0] == cost[1]
    assert cost[0] != cost[2]


def test_solver_measures_cold_starts_to_convergence(tmp_path):
    arguments = ("--robots", 1, "--horizons", 3, "--qp", "structured,ldl")
    rows = tiny("solver", tmp_path, *arguments, "--no-ditches")["rows"]
    cold = [row for row in rows if row["start"] == "cold"]
    assert len(cold) == len(rows) - len(cold) == 4
    for row in cold:
        assert row["solver"] == "sqp"
        assert row["failed_steps"] == 0
        assert row["setup_ms"] > 0
        assert row["cost"] == pytest.approx(cold[0]["cost"], rel=1e-5)


def test_solver_adds_ditches_and_long_horizons(tmp_path):
    arguments = ("--robots", 1, "--horizons", 3, "--qp", "structured", "--long")
    rows = tiny("solver", tmp_path, *arguments)["rows"]
    assert {row["ditches"] for row in rows} == {0, 12}
    assert {row["horizon"] for row in rows} == {3, 60, 120}
    assert all(row["solve_ms"] for row in rows)


def test_rates_are_recorded_for_rerun(tmp_path):
    pytest.importorskip("rerun")
    rrd = tmp_path / "rates.rrd"
    tiny("horizon", tmp_path, "--robots", 1, "--horizons", 3, "--qp", "structured", "--rrd", rrd)
    assert rrd.read_bytes().startswith(b"RRF2")


# ---- taking up again ---------------------------------------------------------------------------


def test_resume_keeps_what_is_there_and_measures_the_rest(tmp_path):
    base = ("--robots", 1, "--horizons", 3)
    first = tiny("horizon", tmp_path, *base, "--qp", "structured")["rows"]
    lines = (tmp_path / "rows.jsonl").read_text().splitlines()
    with (tmp_path / "rows.jsonl").open("a") as file:
        file.write('{"key": "cut o')
    rows = tiny("horizon", tmp_path, *base, "--resume")["rows"]
    assert rows[: len(first)] == first
    assert len(rows) == len(SOLVERS)
    assert (tmp_path / "rows.jsonl").read_text().splitlines()[: len(lines)] == lines
    assert tiny("horizon", tmp_path, *base, "--resume")["rows"] == rows


def test_resume_does_not_mix_conditions(tmp_path):
    base = ("--robots", 1, "--horizons", 3, "--qp", "structured")
    first = tiny("horizon", tmp_path, *base)["rows"]
    other = tiny("horizon", tmp_path, *base, "--resume", "--seed", 7)["rows"]
    assert first[0]["cost"] != other[0]["cost"]


def test_resume_refuses_a_file_of_something_else(tmp_path):
    (tmp_path / "rows.jsonl").write_text('{"key": 1}\n{"key": 2}\n')
    result = bench("horizon", "--out", tmp_path, "--robots", 1, "--horizons", 3, "--resume")
    assert result.exit_code == 2
    assert "line 1 is not a row" in " ".join(result.output.split())


# ---- bad options -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["horizon", "--robots", "17"], "--robots 17"),
        (["horizon", "--horizons", "5,x"], "--horizons '5,x'"),
        (["horizon", "--horizons", "0"], "at least 1"),
        (["horizon", "--horizons", "5,5"], "differ"),
        (["horizon", "--qp", "magic"], "structured, ldl, osqp"),
        (["horizon", "--repetitions", "0"], "--repetitions"),
        (["horizon", "--threads", "0"], "--threads"),
        (["horizon", "--json", "/nowhere/x.json"], "there is no folder"),
        (["horizon", "--out", __file__], "is a file"),
        (["solver", "--robots", "1,17"], "--robots 17"),
        (["peers", "--acados", "/nowhere"], "no acados there"),
        (["magic"], "magic"),
    ],
)
def test_bad_options_exit_with_two_and_say_why(tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    result = bench(*arguments)
    assert result.exit_code == 2, result.output
    assert message in " ".join(result.output.split())


# ---- pieces ------------------------------------------------------------------------------------


class Counting:
    """A run that notes when its turn is, and fails at a given step."""

    def __init__(self, name, log, fails_at=None):
        self.name, self.log, self.fails_at, self.count = name, log, fails_at, 0

    def step(self):
        self.count += 1
        self.log.append(self.name)
        if self.count == self.fails_at:
            raise ValueError("out of order")
        return step(float(self.count))


def test_runs_take_turns():
    log = []
    runs = {name: Counting(name, log) for name in "ab"}
    records = take_turns(runs, steps=3, turn=2, skip=2)
    assert "".join(log) == "aabbaabbab"
    assert [s.solve_ms for s in records["a"].steps] == [3.0, 4.0, 5.0]


def test_all_tasks_of_a_team_take_turns(tmp_path):
    variants = [Variant(Task(robots, n), SOLVERS[0]) for robots in (1, 2) for n in (2, 3)]
    groups = []
    Measurement(steps=1, seed=0, folder=tmp_path).run(variants, announce=groups.append)
    assert groups == ["1 robots, warm", "2 robots, warm"]


def test_a_run_that_raises_is_out_and_the_others_go_on():
    log, calls = [], []
    runs = {"a": Counting("a", log, fails_at=3), "b": Counting("b", log)}
    records = take_turns(runs, steps=4, turn=2, skip=0, progress=lambda: calls.append(1))
    assert len(records["a"].steps) == 2
    assert records["a"].error == "ValueError: out of order"
    assert len(records["b"].steps) == 4
    assert len(calls) == 8


def test_a_row_counts_failed_steps():
    record = Record([step(), step(failure="qp_failed: no")])
    row = make_row(STRUCTURED, record, converged_cost=1.0, qp_flops=3e6)
    assert (row["steps"], row["failed_steps"], row["error"]) == (2, 1, "qp_failed: no")
    assert row["cost_excess"] == pytest.approx(1.0)
    assert row["python_ms"] == pytest.approx(1.0)
    assert row["gflops"] == pytest.approx(3.0)
    assert row["feedback_ms"] is None


def test_the_feedback_phase_counts_where_it_was_measured():
    steps = [step(), replace(step(), feedback_ms=0.2), replace(step(), feedback_ms=0.4)]
    assert make_row(STRUCTURED, Record(steps))["feedback_ms"] == pytest.approx(0.3)


def test_a_row_without_steps_is_marked_and_printed():
    row = make_row(STRUCTURED, Record(error="ValueError: no"))
    assert row["solve_ms"] is None
    json.dumps(row, allow_nan=False)
    console = Console(record=True, width=100)
    console.print(time_table("times", [row]))
    assert "ValueError: no" in console.export_text()


def test_quantiles():
    assert percentiles(list(range(101))) == {"p50": 50, "p95": 95, "p99": 99, "max": 100}


def rows_of(times, solver=SOLVERS[0], **columns):
    return [
        {**Variant(Task(2, n), solver).columns(), **columns, "solve_ms": {"p50": t}}
        for n, t in times.items()
    ]


def test_slopes_are_exponents():
    rows = rows_of({n: 0.01 * n**1.5 for n in (5, 10, 40)})
    assert slope(rows, "horizon") == pytest.approx(1.5)
    assert slope(rows[:1], "horizon") is None


def test_speedups_compare_equal_tasks():
    mine = rows_of({15: 0.2, 31: 0.5})
    paper = rows_of({15: 10.0}, PAPER_SOLVER)
    rows = [*mine, *paper, *rows_of({15: 99.0}, PAPER_SOLVER, start="cold")]
    assert speedup(mine[0], rows, PAPER_SOLVER) == pytest.approx(50)
    assert speedup(mine[1], rows, PAPER_SOLVER) is None
    assert speedup(mine[0], rows, Solver("ldl", "paper")) is None


def test_either_figure_is_compared():
    mine = [{**row, "replay_ms": {"p50": 0.1}} for row in rows_of({15: 0.2})]
    paper = [{**row, "replay_ms": {"p50": 4.0}} for row in rows_of({15: 10.0}, PAPER_SOLVER)]
    assert speedup(mine[0], [*mine, *paper], PAPER_SOLVER, "replay_ms") == pytest.approx(40)
    unknown = [{**row, "replay_ms": None} for row in paper]
    assert speedup(mine[0], [*mine, *unknown], PAPER_SOLVER, "replay_ms") is None


def test_tables_fit_a_terminal_of_80_columns():
    variant = Variant(Task(2, 31, 12), PAPER_SOLVER)
    row = make_row(variant, Record([step(123.456)]), converged_cost=1.0, qp_flops=22.2e6)
    row |= {"replay_ms": row["solve_ms"], "error": "once", "failed_steps": 1, "feedback_ms": 99.123}
    row["phases_ms"] = dict.fromkeys(SQP_PHASES, 99.123)
    console = Console(record=True, width=80)
    for table in (time_table, phase_table, work_table):
        console.print(table("title", [row]))
    text = console.export_text()
    assert "\u2026" not in text
    assert all(len(line) <= 80 for line in text.splitlines())


def test_variants_have_keys_of_their_own():
    tasks = (Task(1, 15), Task(1, 1), Task(1, 5, 12))
    variants = [Variant(t, s, start) for t in tasks for s in SOLVERS for start in ("warm", "cold")]
    assert len({v.key for v in variants}) == len(variants)


def test_a_replay_takes_the_steps_of_the_loop_again():
    planner = make_planner(Task(robots=1, horizon=3), max_iterations=1)
    replay = Replay(planner.lowered, {"max_iterations": 1})
    loop = ClosedLoop(planner, np.random.default_rng(1))
    for _ in range(Replay.EVERY - 1):
        assert replay.measure(loop.tick()[0].plan) == ()
    plan = loop.tick()[0].plan
    assert len(replay.measure(plan)) == Replay.EVERY
    np.testing.assert_allclose(replay._sqp.latest, plan.xs, atol=1e-6)
    assert replay.measure(plan) == ()
