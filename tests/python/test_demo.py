"""`palanquin demo`: its files, its figures, its exit status, and what it says about bad input."""

import json
import sys

import pytest
from typer.testing import CliRunner

from palanquin.cli import app
from palanquin.sim.show import graphics

KEYS = {
    "scenario",
    "tracking",
    "seed",
    "robots",
    "settings",
    "completed",
    "fell",
    "duration_s",
    "distance_m",
    "payload_position_error_m",
    "violation",
    "solve_ms",
    "deadline_misses",
    "fallbacks",
}
PERCENTILES = {"p50", "p95", "p99", "max"}
# What differs from run to run.
MEASURED = {
    "solve_ms",
    "solver_ms",
    "phases_ms",
    "deadline_misses",
    "control_ms_mean",
    "real_time_factor",
}


def run(folder, *arguments):
    options = ["--out", folder, "--headless", "--duration", "0.5", *arguments]
    return CliRunner().invoke(app, ["demo", "trot", *map(str, options)])


def figures_of(path):
    def refuse(token):
        raise AssertionError(f"{token} is not JSON")

    return json.loads(path.read_text(), parse_constant=refuse)


@pytest.fixture
def no_graphics(monkeypatch):
    """Nothing can be drawn, as on a machine without OpenGL; it saves time, too."""
    monkeypatch.setattr(graphics, "_PROBE", "raise SystemExit('{0}')")
    graphics.offscreen_backend.cache_clear()
    yield
    graphics.offscreen_backend.cache_clear()


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo")
    return folder, run(folder)


def test_a_demo_completes_with_all_figures(demo):
    folder, result = demo
    assert result.exit_code == 0, result.output
    figures = figures_of(folder / "trot" / "trot.json")
    assert set(figures) >= KEYS
    assert (figures["scenario"], figures["tracking"]) == ("trot", "physics")
    assert (figures["seed"], figures["robots"], figures["fallbacks"]) == (0, 2, 0)
    assert figures["completed"] is True
    assert figures["fell"] is False
    assert figures["duration_s"] == pytest.approx(0.5)
    assert set(figures["solve_ms"]) == set(figures["solver_ms"]) == PERCENTILES
    assert figures["settings"]["sqp_iterations_per_period"] == 1
    families = {"leg", "arm", "normal", "friction", "leg_torque", "arm_torque"}
    assert set(figures["violation"]) == families
    soft = figures["violation"].pop("leg_torque")  # by 1 N m in the first step, at full speed
    assert soft < 0.05
    assert max(figures["violation"].values()) < 0.02
    assert 0.5 < figures["torque_fraction_max"] <= 1.0
    assert figures["control_fallbacks"] == 0
    assert 0 < figures["slip_m"] < 3e-3
    assert set(figures["payload_position_error_m"]) == {"rms", "max"}
    assert figures["payload_position_error_m"]["max"] < 0.02


def test_a_demo_says_where_its_files_are(demo):
    folder, result = demo
    names = ["trot.json", "figures.png"]
    if "no recording" not in result.output:
        names += ["trot.rrd"]
    if "no picture" not in result.output:
        names += ["trot.png", "trot.mp4"]
    for name in names:
        assert (folder / "trot" / name).stat().st_size > 1000 or name == "trot.json"
        assert f": {folder / 'trot' / name}" in result.output


def test_without_graphics_the_rest_is_made(tmp_path, no_graphics):
    result = run(tmp_path)
    assert result.exit_code == 0, result.output
    assert "libegl1" in result.output
    assert "libosmesa6" in result.output
    assert (tmp_path / "trot" / "trot.json").is_file()
    assert not (tmp_path / "trot" / "trot.png").exists()


def test_without_rerun_the_rest_is_made(tmp_path, no_graphics, monkeypatch):
    import palanquin.sim

    monkeypatch.setitem(sys.modules, "rerun", None)
    monkeypatch.delitem(sys.modules, "palanquin.sim.show.rerun_log", raising=False)
    monkeypatch.delattr(palanquin.sim, "rerun_log", raising=False)
    result = run(tmp_path)
    assert result.exit_code == 0, result.output
    assert "pip install palanquin[viz]" in result.output
    assert not (tmp_path / "trot" / "trot.rrd").exists()


def test_a_seed_repeats(tmp_path, no_graphics):
    def figures(name, seed):
        file = tmp_path / name
        assert run(tmp_path, "--seed", seed, "--json", file).exit_code == 0
        return {key: v for key, v in figures_of(file).items() if key not in {*MEASURED, "seed"}}

    first, again, other = figures("a", 3), figures("b", 3), figures("c", 4)
    assert first == again
    assert first["payload_position_error_m"] != other["payload_position_error_m"]


def test_options_reach_the_run(tmp_path, no_graphics):
    options = ["--robots", 1, "--gait", "pace", "--velocity", "0.2,-0.1", "--rate", 50]
    result = run(tmp_path, *options, "--horizon", 12, "--qp", "ldl", "--rrd", tmp_path / "x.rrd")
    assert result.exit_code == 0, result.output
    figures = figures_of(tmp_path / "trot" / "trot.json")
    settings = figures["settings"]
    assert figures["robots"] == 1
    assert settings["gait"] == "pace"
    assert settings["velocity"] == [0.2, -0.1, 0.0]
    assert (settings["rate_hz"], settings["horizon"], settings["qp"]) == (50.0, 12, "ldl")
    assert (tmp_path / "x.rrd").is_file() or "no recording" in result.output


def test_a_kinematic_demo_tells_of_its_joints(tmp_path, no_graphics):
    result = run(tmp_path, "--tracking", "kinematic")
    assert result.exit_code == 0, result.output
    figures = figures_of(tmp_path / "trot" / "trot.json")
    assert figures["tracking"] == "kinematic"
    assert figures["kinematics"]["hand_error_max_m"] < 1e-3
    assert "torque_fraction_max" not in figures


def test_a_demo_by_estimates_tells_how_good_they_were(tmp_path, no_graphics):
    result = run(tmp_path, "--state", "estimated")
    assert result.exit_code == 0, result.output
    assert "estimate of payload, rms" in result.output
    figures = figures_of(tmp_path / "trot" / "trot.json")
    assert figures["settings"]["state"] == "estimated"
    assert set(figures["estimation_error"]) == {"payload", "robots"}
    assert 0 < figures["estimation_error"]["robots"]["position_rms"] < 0.01
    assert figures["plans"] == {"lost": 0, "oldest_s": pytest.approx(0.01)}


def test_a_team_that_falls_in_physics_says_what_fell(tmp_path, no_graphics):
    result = run(tmp_path, "--robots", "1", "--velocity", "-5", "--duration", "3")
    assert result.exit_code == 1, result.output
    figures = figures_of(tmp_path / "trot" / "trot.json")
    assert (figures["fell"], figures["completed"]) == (True, False)
    assert figures["duration_s"] < 3
    assert f"not completed: {figures['fall']['cause']}" in result.output


def test_a_team_that_falls_has_not_completed(tmp_path, no_graphics):
    options = ["--robots", "1", "--velocity", "-40", "--duration", "0.8"]
    result = run(tmp_path, *options, "--tracking", "kinematic")
    assert result.exit_code == 1, result.output
    assert "not completed: a body fell" in result.output
    assert "where planning failed last: plan of 'clm1': " in result.output
    assert "may not be executed" in result.output
    figures = figures_of(tmp_path / "trot" / "trot.json")
    assert figures["fell"] is True
    assert figures["completed"] is False


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--robots", "5"], "robots: 5 must be from 1 to 4"),
        (["--gait", "hop"], "gait 'hop' is unknown; there are stand, trot"),
        (["--gait", "stand"], "must be 0 with the gait 'stand'"),
        (["--velocity", "fast"], "--velocity fast: VX[,VY[,WZ]] is needed"),
        (["--velocity", "1,2,3,4"], "--velocity 1,2,3,4: VX[,VY[,WZ]] is needed"),
        (["--velocity", "nan"], "--velocity nan"),
        (["--duration", "nan"], "duration: is nan; input should be a finite number"),
        (["--duration", "1e9"], "it must have from 1 to 50000"),
        (["--duration", "0.001"], "it must have from 1 to 50000"),
        (["--rate", "0"], "planner.rate: is 0.0; input should be greater than or equal to 1"),
        (["--horizon", "0"], "planner.horizon: is 0; input should be greater than or equal to 1"),
        (["--qp", "magic"], "'magic'"),
        (["--seed", "-1"], "--seed"),
        (["--rate", "30"], "0.03333333333333333 s must be whole physics steps"),
        (["--tracking", "hope"], "hope"),
        (["--state", "guessed"], "guessed"),
        (["--tracking", "kinematic", "--state", "noisy"], "a kinematic run has no sensors"),
    ],
)
def test_bad_options_are_refused(tmp_path, arguments, message):
    result = run(tmp_path, *arguments)
    assert result.exit_code == 2, result.output
    assert message in " ".join(result.output.split())


def test_help_is_about_scenarios_and_names_the_other_demos():
    result = CliRunner().invoke(app, ["demo", "--help"])
    assert result.exit_code == 0
    assert "demo  [OPTIONS] {NAME|FILE}" in result.output
    assert "--velocity" in result.output
    assert "demo bar --help" in " ".join(result.output.split())


def test_an_unknown_scenario_is_refused(tmp_path):
    result = CliRunner().invoke(app, ["demo", "fly", "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert "scenario: 'fly' is not known; known are ditch, " in result.output


def test_bad_places_are_refused(tmp_path):
    file = tmp_path / "file"
    file.touch()
    result = CliRunner().invoke(app, ["demo", "trot", "--out", str(file)])
    assert result.exit_code == 2
    assert "is a file; a folder is needed" in result.output
    for option in ("--json", "--rrd"):
        result = run(tmp_path, option, tmp_path / "none" / "x")
        assert result.exit_code == 2
        assert f"{option} " in result.output
        assert "there is no folder" in result.output
