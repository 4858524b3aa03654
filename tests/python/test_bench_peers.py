"""`palanquin bench peers`: solvers that share nothing with ours find the same optima."""

import casadi as ca
import numpy as np
import pytest
from support.strict_json import strict_json
from typer.testing import CliRunner

from palanquin.benchmarks.peers import comparison
from palanquin.benchmarks.peers.acados_stage import build_stage
from palanquin.benchmarks.peers.instance import linked_blocks, make_instances
from palanquin.benchmarks.peers.ocp_peers import OWN_SOLVERS, CasadiPeer, Judge, OwnPeer
from palanquin.benchmarks.peers.outcome import Answers, Outcome, ask, make_rows
from palanquin.benchmarks.peers.qp_peers import CasadiQpPeer, OwnQpPeer, StepQps
from palanquin.benchmarks.trot import build_problem
from palanquin.benchmarks.variant import Task
from palanquin.cli import app

TASK = Task(robots=1, horizon=8)  # feet land and lift off within it


@pytest.fixture(scope="module")
def lowered(session_cache):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PALANQUIN_CACHE", str(session_cache))
        yield build_problem(TASK).lower()


@pytest.fixture(scope="module")
def instances(lowered):
    return make_instances(lowered, TASK, 2, seed=0)


@pytest.fixture(scope="module")
def judge(lowered, instances):
    return Judge(lowered, instances)


@pytest.mark.parametrize("plugin", ["ipopt", "fatrop"])
def test_casadi_finds_our_optimum(lowered, instances, judge, plugin):
    ours = OwnPeer(lowered, instances, judge, OWN_SOLVERS[0]).solve(1)
    theirs = CasadiPeer(plugin, build_problem(TASK), instances, judge).solve(1)
    for outcome in (ours, theirs):
        assert not outcome.failure
        assert outcome.residual < 1e-6
    assert theirs.cost == pytest.approx(ours.cost, rel=1e-5)


@pytest.mark.parametrize(("plugin", "form"), [
    ("osqp", "reduced"), ("osqp", "paper"), ("hpipm", "reduced"),
])  # fmt: skip
def test_casadi_solves_our_qp_as_we_do(lowered, instances, plugin, form):
    qps = StepQps(lowered, form, instances)
    ours = OwnQpPeer("ldl", qps).solve(1)
    theirs = CasadiQpPeer(plugin, qps).solve(1)
    for outcome in (ours, theirs):
        assert not outcome.failure
        assert outcome.residual < 1e-5
    assert theirs.cost == pytest.approx(ours.cost, rel=1e-5)


def test_acados_stage_says_what_we_say(lowered, instances, judge):
    """Costs and dynamics of acados' stage along our optimum are ours."""
    problem, instance = build_problem(TASK), instances[0]
    stage = build_stage(problem, linked_blocks(problem, instance))
    peer = OwnPeer(lowered, instances, judge, OWN_SOLVERS[0])
    best = peer.solve(0)
    z, p = peer._solver._core.trajectory, instance.params.values
    is_state = np.concatenate([np.full(b.size, b.is_state) for b in problem.blocks])
    is_foot = np.concatenate([np.full(b.size, b.name.endswith("foot")) for b in problem.blocks])
    arguments = [stage.s, stage.u, stage.p]
    evaluate = ca.Function("stage", arguments, [stage.z, stage.following, stage.cost])
    terminal = ca.Function("terminal", [stage.s, stage.p], [stage.terminal_cost])

    def state(k):
        feet = instance.measured.values if k == 0 else z[k - 1]
        return np.concatenate([z[k, is_state], feet[is_foot]])

    cost = float(terminal(state(TASK.horizon), p[-1]))
    for k in range(TASK.horizon):
        knot, following, running = evaluate(state(k), z[k, ~is_state], p[k])
        np.testing.assert_allclose(np.asarray(knot).ravel(), z[k], atol=1e-9)
        np.testing.assert_allclose(np.asarray(following).ravel(), state(k + 1), atol=1e-6)
        cost += float(running)
    assert cost == pytest.approx(best.cost, rel=1e-9)


def test_acados_hessian_is_positive_definite(instances):
    problem = build_problem(TASK)
    stage = build_stage(problem, linked_blocks(problem, instances[0]))
    hessian = ca.Function("hessian", [stage.s, stage.u, stage.p], [stage.hessian])
    random = np.random.default_rng(0)
    s, u = (random.standard_normal(v.numel()) for v in (stage.s, stage.u))
    H = np.asarray(hessian(s, u, instances[0].params.values[3]))
    np.testing.assert_allclose(H, H.T, atol=1e-8 * np.abs(H).max())
    assert np.linalg.eigvalsh(H).min() > 0


class Scripted:
    """A peer that answers from a list; None stands for an error."""

    columns = {"solver": "scripted"}  # noqa: RUF012
    setup_ms = 0.0

    def __init__(self, label, answers):
        self.label, self.answers = label, answers

    def solve(self, index):
        if self.answers[index] is None:
            raise RuntimeError("lost")
        return self.answers[index]


def test_peers_are_judged_by_the_best_answer():
    good = Scripted("good", [Outcome(1.0, 3, 10.0, 1e-9), Outcome(2.0, 3, 4.0, 1e-7)])
    poor = Scripted("poor", [Outcome(0.1, None, 11.0, 1e-9), Outcome(0.1, None, 4.0, 0.0)])
    wrong = Scripted("wrong", [Outcome(0.1, 1, 1.0, 5.0, "gave up")] * 2)
    broken = Scripted("broken", [good.answers[0], None])
    peers = [good, poor, wrong, broken]
    answers = ask(peers, 2)
    rows = {row["peer"]: row for row in make_rows("ocp", peers, answers, {"robots": 1})}
    assert rows["good"]["cost_excess"] == 0
    assert rows["good"]["residual"] == 1e-7
    assert rows["poor"]["cost_excess"] == pytest.approx(0.1)
    assert rows["poor"]["iterations"] is None
    assert (rows["wrong"]["failed_steps"], rows["wrong"]["error"]) == (2, "gave up")
    assert rows["broken"]["solve_ms"] is None
    assert rows["broken"]["error"] == "RuntimeError: lost"
    assert all(row["robots"] == 1 for row in rows.values())


def test_nobody_solved_anything():
    peer = Scripted("wrong", [Outcome(0.1, 1, 1.0, 5.0, "gave up")])
    answers = {"wrong": Answers(peer.answers)}
    assert make_rows("qp", [peer], answers, {})[0]["cost_excess"] is None


def test_the_command_writes_rows_and_says_what_it_skips(tmp_path, session_cache, monkeypatch):
    monkeypatch.setenv("PALANQUIN_CACHE", str(session_cache))
    monkeypatch.setattr(comparison, "OWN_SOLVERS", OWN_SOLVERS[:1])  # Ipopt's code compiles long
    arguments = ["bench", "peers", "--robots", "1", "--horizon", "3", "--repetitions", "2"]
    result = CliRunner().invoke(app, [*arguments, "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert "acados is skipped" in result.output
    rows = strict_json(tmp_path / "results.json")["rows"]
    keys = {
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
    assert all(set(row) >= keys for row in rows)
    assert {row["problem"] for row in rows} == {"ocp", "qp"}
    assert not [row["peer"] for row in rows if row["error"]]
    assert max(row["cost_excess"] for row in rows if row["problem"] == "ocp") < 1e-5
