"""`palanquin demo bar`: files, exit status, and words about bad options."""

import json

import pytest
from typer.testing import CliRunner

from palanquin.cli import app


def demo(*options: str):
    return CliRunner().invoke(app, ["demo", "bar", "--headless", "--no-video", *options])


def test_demo_writes_its_files(tmp_path):
    options = ["--duration", "0.6", "--payload", "3@0.4", "--noise", "1", "--seed", "3"]
    result = demo(*options, "--out", str(tmp_path), "--rrd", str(tmp_path / "a.rrd"))
    assert result.exit_code == 0, result.output
    figures = json.loads((tmp_path / "bar" / "bar.json").read_text())
    assert figures["scenario"] == "bar"
    assert figures["tracking"] == "physics"
    assert figures["completed"]
    assert figures["duration_s"] == pytest.approx(0.6)
    assert 0 < figures["torque_fraction_max"] <= 1
    assert figures["bar_length_error_m"] < 1e-3
    assert set(figures["solve_ms"]) == {"p50", "p95", "p99", "max"}
    assert (tmp_path / "bar" / "figures.png").stat().st_size > 10_000
    assert (tmp_path / "a.rrd").stat().st_size > 10_000


def test_demo_reports_a_fall(tmp_path):
    options = ["--duration", "3", "--force", "push:0,900,0@0.1,0.6", "--out", str(tmp_path)]
    result = demo(*options)
    assert result.exit_code == 1
    assert "fell after" in result.output
    assert json.loads((tmp_path / "bar" / "bar.json").read_text())["fall"]["cause"]


def test_a_reduced_run_is_shown_too(tmp_path):
    options = ["--duration", "0.6", "--tracking", "reduced", "--out", str(tmp_path)]
    result = demo(*options)
    assert result.exit_code == 0, result.output
    figures = json.loads((tmp_path / "bar" / "bar.json").read_text())
    assert figures["tracking"] == "reduced"
    assert figures["bar_length_error_m"] < 1e-6
    assert "torque_fraction_max" not in figures
    assert (tmp_path / "bar" / "figures.png").stat().st_size > 10_000
    assert (tmp_path / "bar" / "bar.rrd").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--tracking", "reduced", "--terrain", "rough"], "tracking: 'reduced' has flat ground"),
        (["--tracking", "reduced", "--noise", "1"], "'reduced' has no sensors"),
        (["--tracking", "reduced", "--force", "pull:0,-0.2@1,2"], "forces only, no rope"),
        (["--tracking", "kinematic"], "'kinematic' is not one of physics, reduced"),
        (["--terrain", "lava"], "flat, rough, blocks"),
        (["--payload", "much"], "no finite number"),
        (["--force", "wind:2"], "must begin with"),
        (["--velocity", "fast"], "no finite number"),
        (["--velocity", "0.1/0.1/0.1"], "velocities: 3 for 2 robots"),
        (["--robots", "1"], "robots: 1 must be from 2"),
        (["--restrict", "up"], "restrict"),
        (["--friction", "7"], "ground.friction: 7.0"),
        (["--duration", "-1"], "duration: -1.0"),
        (["--delay", "3"], "delay is 3000"),
        (["--planner", "oracle"], "oracle"),
    ],
)
def test_bad_options_are_explained(options, message, tmp_path):
    result = demo(*options, "--out", str(tmp_path))
    assert result.exit_code == 2
    assert message in " ".join(result.output.split())
