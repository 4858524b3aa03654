"""The package as installed: what it loads, where it looks for libraries, and its use from C++."""

import importlib.metadata
import os
import re
import subprocess
import sys
import sysconfig
import tomllib
from pathlib import Path

import numpy as np
import pytest
from support.programs import run

import palanquin as pq

ROOT = Path(__file__).resolve().parents[2]
INSTALLED = Path(sysconfig.get_path("platlib")) / "palanquin"


def test_import_needs_no_simulator():
    blocked = "import sys; sys.modules.update(mujoco=None, pinocchio=None, rerun=None)"
    run(sys.executable, "-c", f"{blocked}; import palanquin; import palanquin.cli")


@pytest.mark.parametrize(
    ("name", "folders"),
    [
        ("_core", "$ORIGIN/../casadi"),
        ("_sim", "$ORIGIN/../mujoco:$ORIGIN/../cmeel.prefix/lib:$ORIGIN/../casadi"),
    ],
)
def test_extensions_find_their_libraries_by_relative_paths_only(name, folders):
    (extension,) = INSTALLED.glob(f"{name}.*.so")
    paths = re.findall(r"\((?:RPATH|RUNPATH)\).*\[(.*)\]", run("readelf", "-d", extension))
    assert paths == [folders]


def test_build_and_run_time_pins_agree():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    dependencies = project["project"]["dependencies"]
    for name in ("casadi", "cmeel-eigen", "libpinocchio", "mujoco-core"):
        (pin,) = [r for r in project["build-system"]["requires"] if r.startswith(f"{name}==")]
        assert pin in dependencies
        assert pin == f"{name}=={importlib.metadata.version(name)}"


def cart(policy):
    """A cart that would rather be beyond a wall."""
    problem = pq.Problem(horizon=20, dt=0.05, name="cart")
    position, velocity = problem.state("position", 1), problem.state("velocity", 1)
    force = problem.input("force", 1)
    problem.dynamics(position, increment=problem.dt * velocity)
    problem.dynamics(velocity, increment=problem.dt * force)
    goal = problem.parameter("goal", default=2.0)
    problem.residual("goal", position - goal, at="all")
    problem.residual("effort", force, weight=0.1)
    problem.inequality("wall", position <= 0.5, policy=policy, at="terminal")
    return problem


def printed_plan(program, *arguments):
    return np.loadtxt(run(program, *arguments).splitlines())


@pytest.mark.parametrize(
    "policy", [pq.Hard(), pq.Penalty(4.0, 0.01), pq.SquaredHinge(7.0), pq.RelaxedBarrier()]
)
def test_cpp_program_solves_what_python_stated(policy, consumer, tmp_path):
    lowered = cart(policy).lower()
    planned = pq.Sqp(lowered, qp="multipliers").solve(lowered.parameters(), lowered.knot())
    assert planned.is_usable
    assert planned.violation["wall"] < (1e-6 if policy == pq.Hard() else 1.0)
    folder = lowered.save(tmp_path / "cart")
    np.testing.assert_array_equal(printed_plan(consumer, folder), planned.xs)
    np.testing.assert_array_equal(printed_plan(consumer, lowered.report.path), planned.xs)

    parameters = lowered.parameters()
    parameters["goal"] = 0.25
    planned = pq.Sqp(lowered, qp="multipliers").solve(parameters, lowered.knot())
    np.testing.assert_array_equal(printed_plan(consumer, folder, "goal", "0.25"), planned.xs)


def test_a_saved_folder_builds_by_cmake_alone(consumer, tmp_path):
    lowered = cart(pq.Hard()).lower()
    planned = pq.Sqp(lowered, qp="multipliers").solve(lowered.parameters(), lowered.knot())
    folder = lowered.save(tmp_path / "cart")
    (folder / "sqp.so").unlink()
    tools = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    run("cmake", "-S", folder, "-B", tmp_path / "build", env=tools)
    run("cmake", "--build", tmp_path / "build", env=tools)
    np.testing.assert_array_equal(printed_plan(consumer, folder), planned.xs)
    assert pq.load(folder).report.path == folder / "sqp.so"
    run("cmake", "--build", tmp_path / "build", "--target", "cart-nlp", env=tools)
    assert pq.load(folder).library("nlp") == str(folder / "nlp.so")


def test_cpp_program_refuses_a_damaged_folder(consumer, tmp_path):
    folder = cart(pq.Hard()).lower().save(tmp_path / "cart")
    text = (folder / "manifest").read_text()
    (folder / "manifest").write_text(text.replace("horizon 20", "horizon 2,0"))
    done = subprocess.run([consumer, folder], capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "manifest line 'horizon 2,0': '2,0' must be an integer" in done.stderr


@pytest.mark.parametrize("command", [["palanquin"], [sys.executable, "-m", "palanquin"]])
def test_command_line_states_its_versions(command):
    if command == ["palanquin"]:
        command = [Path(sys.executable).with_name("palanquin")]
    printed = dict(line.split(maxsplit=1) for line in run(*command, "--version").splitlines())
    assert printed["palanquin"] == importlib.metadata.version("palanquin")
    assert printed["casadi"] == importlib.metadata.version("casadi")
    for name in ("OSQP", "Ipopt", "Eigen"):
        assert re.fullmatch(r"\d+\.\d+\.\d+\S*", printed[name]), printed
    assert "scenario" in run(*command, "--help")
