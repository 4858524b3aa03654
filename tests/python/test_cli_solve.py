"""`palanquin solve`: its files, its exit status, and what it says about bad input."""

import json
from pathlib import Path

import numpy as np
import pytest
from support.strict_json import strict_json
from typer.testing import CliRunner

from palanquin.cli import app
from palanquin.cli.solve import Solver

CASES = Path(__file__).parents[1] / "data" / "cases"
KEYS = {
    "status",
    "message",
    "cost",
    "tracking_cost",
    "penalty_cost",
    "equality_violation",
    "inequality_violation",
    "iterations",
    "time_ms",
    "X",
    "U",
}


def run(*arguments):
    return CliRunner().invoke(app, ["solve", *map(str, arguments)])


@pytest.mark.parametrize("solver", list(Solver))
def test_a_solved_case(tmp_path, solver):
    file = tmp_path / "plan.json"
    result = run(CASES / "trot.json", "--solver", solver.value, "--out", file)
    assert result.exit_code == 0, result.output
    figures = strict_json(file)
    assert set(figures) == KEYS
    assert np.shape(figures["X"]) == (16, 39)
    assert np.shape(figures["U"]) == (15, 60)
    assert set(figures["inequality_violation"]) == {"leg", "arm", "normal", "friction"}
    assert figures["cost"] == pytest.approx(figures["tracking_cost"] + figures["penalty_cost"])


def test_a_case_that_is_not_solved_is_written_all_the_same(tmp_path):
    file = tmp_path / "plan.json"
    result = run(CASES / "ramp.json", "--solver", "ipopt", "--iterations", 1, "--out", file)
    assert result.exit_code == 1
    assert "not solved" in result.output
    figures = strict_json(file)
    assert set(figures) == KEYS
    assert figures["status"] != "converged"
    assert figures["equality_violation"] > 1e-6


def test_an_infeasible_case_names_its_worst_rows(tmp_path):
    data = json.loads((CASES / "stand.json").read_text())
    data["robots"][0]["lf"] = 0.05  # legs that cannot reach the ground they stand on
    case = tmp_path / "case.json"
    case.write_text(json.dumps(data))
    file = tmp_path / "plan.json"
    result = run(case, "--solver", "ipopt", "--out", file)
    assert result.exit_code == 1
    assert "leg" in result.output
    assert "robot1" in result.output
    assert strict_json(file)["inequality_violation"]["leg"] > 0.05


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda data: data.pop("mu"), "mu: is missing"),
        (lambda data: data["robots"][0].update(m=-1), "robots[0].m: is -1"),
        (lambda data: data["x0"].__setitem__(0, float("nan")), "x0: entry [0] is nan"),
        (lambda data: data["terrain"].update(type="moon"), "type 'moon' is unknown"),
        (lambda data: data.update(wind=1), "unknown key 'wind'"),
    ],
)
def test_bad_cases_exit_with_two_and_say_why(tmp_path, change, message):
    data = json.loads((CASES / "stand.json").read_text())
    change(data)
    case = tmp_path / "case.json"
    case.write_text(json.dumps(data))
    file = tmp_path / "plan.json"
    result = run(case, "--out", file)
    assert result.exit_code == 2
    assert message in result.output
    assert not file.exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["none.json"], "No such file"),
        ([CASES / "stand.json", "--qp", "magic"], "magic"),
        ([CASES / "stand.json", "--solver", "magic"], "magic"),
        ([CASES / "stand.json", "--iterations", "0"], "--iterations"),
        ([CASES / "stand.json", "--out", "/"], "is a folder"),
        ([CASES / "stand.json", "--out", "/nowhere/plan.json"], "there is no folder"),
    ],
)
def test_bad_arguments_exit_with_two(arguments, message):
    result = run(*arguments)
    assert result.exit_code == 2
    assert message in result.output


def test_help_names_every_option():
    result = run("--help")
    assert result.exit_code == 0
    for option in ("--solver", "--qp", "--iterations", "--penalty", "--starts", "--out"):
        assert option in result.output
