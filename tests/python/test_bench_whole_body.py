"""The whole-body QPs: recorded, taken apart, and solved alike by whoever is installed."""

import numpy as np
import pytest
from support.strict_json import strict_json
from typer.testing import CliRunner

from palanquin.benchmarks.whole_body import comparison
from palanquin.benchmarks.whole_body.comparison import answers_to, installed_peers
from palanquin.benchmarks.whole_body.recorded import COURSES, record
from palanquin.cli import app


@pytest.fixture(scope="module")
def qps():
    return record(COURSES["flat"], 6)


def test_a_recorded_qp_is_that_of_the_controller(qps):
    for qp in qps:
        n, joints = len(qp.g), len(qp.limit)
        contacts = (n - joints) // 3
        assert joints == 12
        assert n == 12 + 3 * contacts
        assert qp.E.shape == (3 * contacts, n)
        assert qp.C.shape == (10 * contacts, n)
        np.testing.assert_array_equal(qp.H, qp.H.T)
        assert np.linalg.eigvalsh(qp.H).min() > 0
        own = qp.own
        np.testing.assert_array_equal(own.A[own.equalities :][:joints], np.eye(joints, n))
        np.testing.assert_array_equal(own.b[own.equalities :][:joints], -qp.limit)


def test_all_solvers_find_the_same_optimum(qps):
    peers, _ = installed_peers()
    for name, answers in answers_to(qps, peers).items():
        assert answers.failures == 0, name
        assert answers.cost_gap < 1e-5, name
        assert answers.violation < 1e-4, name
        assert len(answers.call) == len(qps)


def test_a_failure_is_counted_not_averaged(qps):
    class Failing(comparison.Peer):
        name = "failing"

        def prepare(self, qp):
            pass

        def solve(self):
            return None

    answers = answers_to(qps, [Failing()])["failing"]
    assert answers.failures == len(qps)
    assert answers.to_json()["call_us"] is None


def test_the_command_compares_on_each_course(tmp_path, monkeypatch):
    monkeypatch.setattr(comparison, "COURSES", {"flat": COURSES["flat"]})
    file = tmp_path / "rows.json"
    result = CliRunner().invoke(
        app, ["bench", "whole-body", "--problems", "2", "--json", str(file)]
    )
    assert result.exit_code == 0, result.output
    rows = strict_json(file)["rows"]
    assert {row["solver"] for row in rows} == {peer.name for peer in installed_peers()[0]}
    assert all(row["failures"] == 0 and row["qps"] == 2 for row in rows)
    own = next(row for row in rows if row["solver"] == "palanquin")
    assert own["cost_gap"] == 0
    assert own["inside_us"]["p50"] <= own["inside_us"]["max"]
