"""`palanquin figures clm --tracking physics`: the paper's experiments under contact and torques."""

import json
from dataclasses import replace

from typer.testing import CliRunner

from palanquin.benchmarks.clm_paper import in_physics
from palanquin.cli import app


def short(experiment):
    """Cut to 0.4 s, its push in the middle."""
    pushes = [{**dict(p), "start": 0.1, "duration": 0.2} for p in experiment.scenario.pushes]
    scenario = experiment.scenario.changed(duration=0.4, pushes=pushes, gait_changes=[])
    return replace(experiment, scenario=scenario)


def test_experiments_are_the_papers_in_physics():
    experiments = {e.name: e for e in in_physics.experiments()}
    assert set(experiments) == {"push", "push-stand", "ditch", "ramp", "ramp-down"}
    for experiment in experiments.values():
        assert experiment.scenario.tracking == "physics"
        assert experiment.scenario.planner.leg_torque is not None
    assert len(experiments["ditch"].scenario.ditch_lines) == 12
    assert {robot.gait.name for robot in experiments["push-stand"].scenario.robots} == {"stand"}


def test_the_command_writes_report_and_pictures(tmp_path, monkeypatch):
    shortened = tuple(short(experiment) for experiment in in_physics.experiments())
    monkeypatch.setattr(in_physics, "experiments", lambda: shortened)
    arguments = ["figures", "clm", "--tracking", "physics", "--seeds", "1", "--out", str(tmp_path)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code in (0, 1), result.output
    report = (tmp_path / "report.md").read_text()
    for name in ("push", "ditches", "ramp", "ramp-down"):
        assert f"({name}.png)" in report
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000
    results = json.loads((tmp_path / "results.json").read_text())
    for name, rows in results["experiments"].items():
        assert rows[0]["torque_fraction_max"] <= 1.0, name
    assert all(entry["runs"] == 1 for group in results["criteria"].values() for entry in group)


def test_falls_are_counted_by_their_cause():
    experiment = in_physics.experiments()[0]
    row = {
        "fell": True, "fall": {"cause": "left tipped over"}, "fallbacks": [{}],
        "control_fallbacks": 2, "saturated_share": 0.01, "slip_m": 0.002,
    }  # fmt: skip
    steady = {**row, "fell": False, "fall": None, "fallbacks": [], "control_fallbacks": 0}
    runs = in_physics.Runs(experiment, [row, row, steady], None)
    line = in_physics.limits_table([runs]).splitlines()[-1]
    assert line == f"| {experiment.title} | 1 % | 2 | 6 | 2: left tipped over |"
