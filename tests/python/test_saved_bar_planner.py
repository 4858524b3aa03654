"""Planners of robots on bars in folders: C++ programs without Python plan the same, bit by bit."""

import subprocess

import numpy as np
import pytest

from palanquin.errors import LoweringError
from palanquin.problems.layered import CentralizedPlanner
from palanquin.problems.layered.bar_planner import BarPlanner
from palanquin.problems.layered.reference import within_circle
from palanquin.sim.runs.scenarios import loop_of
from palanquin.sim.scenarios import BarScenario

TICKS = 150


def numbers(*arrays):
    return " ".join(repr(float(v)) for array in arrays for v in np.ravel(array))


@pytest.mark.parametrize("kind", ["centralized", "distributed", "nominal"])
def test_a_program_without_python_plans_the_same(kind, consumer, tmp_path):
    """Through first steps, on the reduced plant, of robots that are pushed."""
    forces = ("sin:20",)
    loop = loop_of(BarScenario(planner=kind, tracking="reduced", forces=forces))
    saved = loop.planner.save(tmp_path / "planner")
    record, states, inputs = [], [], []
    for tick, _ in zip(loop.ticks(), range(TICKS), strict=False):
        seen, flags = tick.seen, tick.plan.contacts.astype(int)
        commands = [(v.vx, v.vy, v.wz) for v in map(tick.orders.of, range(2))]
        measured = (seen.time, commands, seen.bodies, seen.feet, seen.footholds, seen.ground)
        record.append(f"{numbers(*measured)} {' '.join(map(str, flags.ravel()))}")
        states.append(tick.plan.bodies.reshape(6, -1))
        inputs.append(tick.plan.forces.reshape(5, -1))
    done = subprocess.run(
        [consumer.with_name("bar_planner"), saved],
        input="\n".join(record),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    rows = iter(np.array(line.split(), dtype=float) for line in done.stdout.splitlines())
    for x, u in zip(states, inputs, strict=True):
        np.testing.assert_array_equal([next(rows) for _ in x], x)
        np.testing.assert_array_equal([next(rows) for _ in u], u)
    assert next(rows, None) is None


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    planner = BarPlanner(CentralizedPlanner(), None, within_circle(0.1))
    with pytest.raises(LoweringError, match="file"):
        planner.save(tmp_path / "file")
