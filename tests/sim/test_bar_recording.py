"""A recording of robots on bars: the same writer as of a payload in hands."""

import numpy as np
import pytest

from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import BarScenario
from palanquin.sim.scenes.bar_scene import build_bar_scene
from palanquin.sim.show.bar_motion import motion_of
from palanquin.sim.show.recording import write_recording


def test_it_holds_bodies_forces_plan_solver_and_control(tmp_path):
    pytest.importorskip("rerun", reason="the extra viz is not installed")
    from rerun.chunk import RrdReader

    scenario = BarScenario(duration=0.3)
    record = run_scenario(scenario)
    path = tmp_path / "bar.rrd"
    scene = build_bar_scene(scenario.team, scenario.ground)
    write_recording(record, motion_of(record, scene), path)
    chunks = {}
    for chunk in RrdReader(str(path)).stream():
        chunks.setdefault(str(chunk.entity_path), []).append(chunk.to_record_batch())
    expected = {
        "/world/left/trunk", "/world/bar1", "/world/ground/surface", "/world/left/LF/force",
        "/plan/left", "/plan/right/RH/force", "/plan/left/footholds", "/solver/solve_ms",
        "/solver/violation/friction", "/solver/left/lambda", "/control/left/velocity/x/desired",
        "/control/left/virtual_constraint/roll", "/control/right/position_error",
    }  # fmt: skip
    assert expected <= chunks.keys(), sorted(expected - chunks.keys())
    assert "/solver/iterations" not in chunks  # the planners tell none
    times = sum(
        batch.num_rows
        for batch in chunks["/solver/solve_ms"]
        if any(name.endswith("scalars") for name in batch.schema.names)
    )
    assert times == len(record.time)
    assert np.isfinite(record.solve_ms).all()
