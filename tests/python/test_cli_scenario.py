"""`palanquin scenario`: what it lists, prints and finds, and its exit status."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from palanquin import benchmarks
from palanquin.cli import app
from palanquin.sim.scenarios import BARS, SHIPPED, Scenario, open_any, open_scenario
from palanquin.sim.scenarios.library import SUITES

BENCHMARKS = Path(benchmarks.__file__).parent


def run(*arguments):
    result = CliRunner().invoke(app, ["scenario", *map(str, arguments)])
    return result.exit_code, result.output


def test_all_shipped_scenarios_are_listed():
    status, output = run("list")
    assert status == 0
    assert all(name in output for name in SHIPPED)
    assert "16 kg beam" in output


def test_a_shown_scenario_is_a_scenario_file(tmp_path):
    status, text = run("show", "team4")
    assert status == 0
    path = tmp_path / "team4.yaml"
    path.write_text(text)
    assert open_scenario(str(path)) == open_scenario("team4")
    assert run("check", path) == (0, f"{path}: nothing speaks against it\n")


FILES = sorted([*SUITES.rglob("*.yaml"), *BENCHMARKS.rglob("*.yaml"), *BARS.values()])


@pytest.mark.parametrize("file", FILES, ids=lambda file: f"{file.parent.name}/{file.stem}")
def test_files_of_suites_and_figures_can_be_run(file):
    status, output = run("check", file)
    assert (status, output) == (0, f"{file}: nothing speaks against it\n")
    assert open_any(str(file)).summary


def test_the_schema_describes_every_field():
    status, text = run("schema")
    assert status == 0
    schema = json.loads(text)
    assert {"robots", "payload", "terrain", "command", "pushes"} <= set(schema["properties"])
    assert schema["additionalProperties"] is False
    assert schema["required"] == ["name", "robots", "command"]


def test_the_reference_names_every_field_with_its_default():
    status, text = run("fields")
    assert status == 0
    assert all(f"| `{field}` |" in text for field in Scenario.model_fields)
    assert "| `height` | number over 0 | `0.47` |" in text
    assert "| `attach` | 3 x number | needed | grasp point" in text


@pytest.mark.parametrize(
    ("old", "new", "status", "message"),
    [
        ("mass: 24", "mas: 24", 2, "mine.yaml:7: payload: unknown key 'mas'"),
        ("[-0.3, -0.5, 0]", "[-0.3, 0.46, 0]", 2, "mine.yaml:4: robots[1].attach: grasp points"),
        ("mass: 24", "mass: 80", 0, "can be run; warnings: 4"),
    ],
)
def test_check_explains_what_is_wrong(tmp_path, monkeypatch, old, new, status, message):
    monkeypatch.chdir(tmp_path)
    text = run("show", "team4")[1]
    assert old in text
    (tmp_path / "mine.yaml").write_text(text.replace(old, new))
    exit_code, output = run("check", "mine.yaml")
    assert exit_code == status
    assert message in output


def test_unknown_scenarios_are_refused():
    for command in ("check", "show"):
        status, output = run(command, "fly")
        assert status == 2
        assert "scenario: 'fly' is not known; known are ditch" in output


def test_what_cannot_be_is_not_run(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(run("show", "trot")[1].replace("[0, -0.6, 0]", "[0, 0.4, 0]"))
    result = CliRunner().invoke(app, ["demo", str(path), "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert "this cannot be: robots[1].attach: right would stand in left" in result.output
