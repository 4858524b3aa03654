"""`palanquin check` takes problems in all the forms that they come in."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

import palanquin as pq
from palanquin.cli import app
from palanquin.cli.check_subjects import subjects

CASES = Path(__file__).parents[1] / "data"


@pytest.fixture(autouse=True)
def cache(session_cache, monkeypatch):
    monkeypatch.setenv("PALANQUIN_CACHE", str(session_cache))


def check(*arguments):
    return CliRunner().invoke(app, ["check", "--quick", *map(str, arguments)])


OWN = """
import casadi as ca
import palanquin as pq

def make(kink=True):
    problem = pq.Problem(horizon=4, dt=0.1, name="own")
    x, u = problem.state("x", 1), problem.input("u", 1)
    problem.dynamics(x, increment=problem.dt * u)
    problem.residual("effort", u)
    problem.residual("root", ca.sqrt(x) if kink else x)
    return problem

good = make(kink=False)
number = 3
"""


@pytest.fixture
def own(tmp_path):
    file = tmp_path / "own.py"
    file.write_text(OWN)
    return file


def test_a_problem_of_ones_own(own, tmp_path):
    assert check(f"{own}:good").exit_code == 0
    found = tmp_path / "found.json"
    result = check(f"{own}:make", "--points", 0, "--json", found)
    assert result.exit_code == 1
    assert "non-finite: residual 'root' by x[0] in running" in result.output
    (report,) = json.loads(found.read_text())
    assert report["is_ok"] is False
    assert {"kind": "non-finite", "row": "residual 'root'"}.items() <= report["findings"][0].items()


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("{own}:missing", "has no 'missing'"),
        ("{own}:number", "a Problem is needed"),
        ("{own}", "which problem?"),
        ("{own.parent}/none.py:x", "there is no such file"),
        ("no-such-thing", "no-such-thing"),
    ],
)
def test_what_is_no_problem_is_refused_in_words(own, source, message):
    result = check(source.format(own=own))
    assert result.exit_code == 2
    assert message in result.output.replace("\n", " ")


def test_dumps_and_saved_folders(own, tmp_path):
    (subject,) = subjects(f"{own}:good")
    lowered = subject.lowered
    plan = pq.Sqp(lowered).solve(lowered.parameters(), lowered.knot())
    dump = plan.dump(tmp_path / "x.palanquin")
    result = check(dump)
    assert result.exit_code == 0, result.output
    assert "knot 0, knot 1, knot 3, knot 4" in result.output
    assert check(lowered.save(tmp_path / "saved")).exit_code == 0


def test_a_problem_of_the_collection():
    result = check("crane", "--points", 1)
    assert result.exit_code == 0, result.output
    assert "check of 'crane'" in result.output
    assert "knot 0" in result.output


@pytest.mark.parametrize(
    ("source", "names"),
    [
        (CASES / "cases" / "stand.json", ["clm2"]),
        ("team3", ["clm3"]),
        (
            CASES / "layered" / "holonomic_trot.json",
            ["layered-2-1", "layered-2-0", "layered-local-1-of-2", "layered-local-2-of-2"],
        ),
    ],
    ids=["case", "scenario", "bar"],
)
def test_teams_are_looked_at_where_they_start(source, names):
    """Their own derivatives are tested elsewhere; here one knot of each is enough."""
    found = list(subjects(str(source)))
    assert [s.lowered.name for s in found] == names
    for subject in found[-1:]:
        assert subject.trajectory is not None
        report = subject.lowered.check(
            subject.parameters, subject.trajectory[:1], random_points=1, libraries=("sqp",)
        )
        assert report.is_ok, str(report)
        assert not [f for f in report.findings if f.kind in ("kink", "indefinite")], str(report)
