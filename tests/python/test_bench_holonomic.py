"""The layered paper's experiments at their smallest."""

import json

import pytest
from support.strict_json import strict_json
from typer.testing import CliRunner

from palanquin.benchmarks.layered import figures
from palanquin.benchmarks.layered.runs import REDUCED
from palanquin.benchmarks.layered.survival import LOADS, Run, run_load, survival_table
from palanquin.cli import app
from palanquin.sim.scenarios.bar_forces import Force


def test_the_benchmark_compares_solvers_on_the_same_qps(tmp_path):
    file = tmp_path / "rows.json"
    arguments = ["bench", "holonomic", "--samples", "10", "--problems", "1", "--json", str(file)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    rows = strict_json(file)["rows"]
    loops = {(r["planner"], r["solver"]) for r in rows if "total_ms" in r}
    assert len(loops) == 6
    gaps = {r["solver"]: r["cost_gap"] for r in rows if r["cost_gap"] is not None}
    assert gaps["piqp (CasADi)"] < 1e-6  # another method, the same optimum
    for row in rows:
        marks = row.get("solve_ms")
        if marks:
            assert marks["p50"] <= marks["p95"] <= marks["p99"] <= marks["max"]


def test_a_bad_output_is_refused_before_measuring(tmp_path):
    arguments = ["bench", "holonomic", "--json", str(tmp_path / "none" / "rows.json")]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 2
    assert "there is no folder" in result.output


def test_a_load_knocks_the_pair_over(monkeypatch):
    forces = tuple(Force.constant(robot, (0.0, 500.0, 0.0), 0.5) for robot in (0, 1))
    monkeypatch.setitem(REDUCED, "much", REDUCED["none"].changed(forces=forces))
    run = run_load("much", "working", "centralized", 3.0)
    assert not run.survived
    assert run.fell_at < 3.0


def test_the_table_has_a_row_per_load_and_a_column_per_planner():
    runs = [
        Run("none", "working", "centralized", None, 0.1, 0, 1.0, 0.0),
        Run("none", "working", "nominal", 1.5, 0.1, 3, 1.0, 0.0),
    ]
    table = survival_table(runs).splitlines()
    assert table[0] == "| load | centralized, working | nominal |"
    assert table[2] == "| none | stands | falls at 1.5 s, 3 failures |"


def test_the_loads_are_there_and_named_once():
    names = [REDUCED[load].summary for load in LOADS]
    assert len(set(names)) == len(names)


def test_a_figure_is_drawn_with_its_numbers(tmp_path):
    drawn = figures.draw_figure9(tmp_path, "working", 0.5)
    assert drawn.file.stat().st_size > 1000
    assert drawn.numbers["distributed"]["length_error_m"] < 1e-6
    json.dumps(drawn.numbers)


def test_figures_refuse_a_file_for_a_folder(tmp_path):
    (tmp_path / "file").write_text("")
    result = CliRunner().invoke(app, ["figures", "layered", "--out", str(tmp_path / "file")])
    assert result.exit_code == 2
    assert "is a file" in result.output


@pytest.mark.parametrize("option", [["--samples", "3"], ["--problems", "0"]])
def test_too_few_samples_are_refused(option):
    assert CliRunner().invoke(app, ["bench", "holonomic", *option]).exit_code == 2
