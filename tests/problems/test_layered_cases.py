"""Cases of the layered problem: solved ones, and files that are wrong."""

import copy
import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from palanquin.cli import app
from palanquin.problems.case_files import CaseError
from palanquin.problems.layered.case import parse_layered_case
from palanquin.problems.layered.solve import solve_layered_case

DATA = Path(__file__).parent.parent / "data" / "layered"
CASE = json.loads((DATA / "holonomic_trot.json").read_text())
EXPECTED = json.loads((DATA / "holonomic_trot.expected.json").read_text())


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    file = tmp_path_factory.mktemp("layered") / "result.json"
    result = CliRunner().invoke(
        app, ["solve", str(DATA / "holonomic_trot.json"), "--out", str(file)]
    )
    assert result.exit_code == 0, result.output
    return json.loads(file.read_text())


def test_linearisation_has_the_case_s_norms(solved):
    for key, value in EXPECTED["linearisation"].items():
        assert solved["linearisation"][key] == pytest.approx(value, rel=1e-9, abs=1e-9), key


def test_costs_are_the_case_s_optima(solved):
    for planner in ("centralized", "nominal"):
        assert solved[planner]["cost"] == pytest.approx(EXPECTED[planner]["obj"], rel=1e-6)
    first = EXPECTED["distributed_first_exchange"]
    assert solved["distributed"]["cost"] == pytest.approx(first["obj"], rel=1e-6)
    assert solved["distributed"]["u"] == pytest.approx(first["u"], abs=1e-3)
    assert np.mean(solved["distributed"]["lams"]) == pytest.approx(first["lam"], abs=1e-8)


def test_parameters_change_the_optimum():
    heavy = copy.deepcopy(CASE)
    heavy["par"] = {"m": 20.0, "R_lambda": 1e-2, "Qxi": 1e7, "mu": 0.3, "N": 6}
    plans = solve_layered_case(parse_layered_case(heavy)).plans
    assert plans["centralized"].inputs.shape == (6, 2, 4, 3)
    lifted = plans["centralized"].forces[..., 2].sum()
    assert lifted > 1.3 * sum(EXPECTED["centralized"]["u"][2::3])


def spoilt(change):
    case = copy.deepcopy(CASE)
    change(case)
    return case


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: c.pop("u_prev"), "u_prev: is missing"),
        (lambda c: c["u_prev"].pop(), r"u_prev: has shape \[23\]; \[24\]"),
        (lambda c: c.update(lam_prev=float("nan")), "lam_prev"),
        (lambda c: c.update(speed=1), "unknown key 'speed'"),
        (lambda c: c["par"].update(magic=1), "unknown key 'magic'.*R_lambda"),
        (lambda c: c["par"].update(m=-1.0), "par.m: is -1.0"),
        (lambda c: c["par"].update(Q_r=[1.0, 2.0]), r"par.Q_r: has shape \[2\]"),
        (lambda c: c["par"].update(N=0), "par.N: is 0"),
        (lambda c: c["state"]["r"].pop(), r"state.r: has shape \[1, 3\]"),
        (lambda c: c["state"]["r"][0].append(1), "state.r: rows have different lengths"),
        (lambda c: c["state"]["stance"][0].__setitem__(2, 0.5), r"stance\[0, 2\] is 0.5"),
        (lambda c: c["state"]["R"][1][0].__setitem__(0, 2.0), r"R\[1\] is no rotation"),
        (lambda c: c["state"].update(psi0=0.0), "state.psi0"),
        (lambda c: c["state"]["v"].__setitem__(0, "fast"), r"state.v: entry \[0\] is 'fast'"),
    ],
)
def test_faults_are_named(change, message):
    with pytest.raises(CaseError, match=message):
        parse_layered_case(spoilt(change))


def test_the_command_reports_bad_input(tmp_path):
    file = tmp_path / "bad.json"
    file.write_text(json.dumps(spoilt(lambda c: c["state"].pop("feet"))))
    result = CliRunner().invoke(app, ["solve", str(file)])
    assert result.exit_code == 2
    assert "state.feet: is missing" in result.output
