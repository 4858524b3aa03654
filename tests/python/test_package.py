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

import palanquin as pq

ROOT = Path(__file__).resolve().parents[2]
INSTALLED = Path(sysconfig.get_path("platlib")) / "palanquin"


def run(*command: str | Path, **options) -> str:
    """Run a command and return what it prints; fail with all of its output."""
    result = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


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


@pytest.fixture(scope="module")
def consumer(tmp_path_factory) -> Path:
    """The executable of the CMake project in consumer/, built against the installed package."""
    build = tmp_path_factory.mktemp("consumer")
    tools = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    source = Path(__file__).with_name("consumer")
    run("cmake", "-S", source, "-B", build, f"-Dpalanquin_ROOT={INSTALLED}", env=tools)
    run("cmake", "--build", build, env=tools)
    return build / "consumer"


def test_cpp_program_solves_a_lowered_problem(consumer):
    cart = pq.Problem(horizon=20, dt=0.1, name="cart")
    position, velocity = cart.state("position", 1), cart.state("velocity", 1)
    force = cart.input("force", 1)
    cart.dynamics(position, increment=cart.dt * velocity)
    cart.dynamics(velocity, increment=cart.dt * force)
    cart.residual("goal", position - cart.parameter("goal"), at="all")
    cart.residual("effort", force, weight=0.1)
    lowered = cart.lower()
    parameters = lowered.parameters()
    parameters["dt"], parameters["goal"] = 0.05, 2.0

    printed = run(consumer, lowered.report.path, "0.05", "2.0")
    planned = pq.Sqp(lowered).solve(parameters, lowered.knot())
    np.testing.assert_allclose(np.loadtxt(printed.splitlines()), planned.xs, atol=1e-9)
    assert planned.trajectory["position"][-1] > 0.5
