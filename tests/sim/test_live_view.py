"""The live view: what it logs of a run while it goes on."""

from itertools import islice

import numpy as np
import pytest

from palanquin.sim.live_swing import LiveFeet
from palanquin.sim.runs import loop
from palanquin.sim.runs.scenarios import nominal
from palanquin.sim.scenarios import open_scenario

TICKS = 20


@pytest.fixture(scope="module")
def ticks():
    scenario = open_scenario("trot")
    period = scenario.planner.period
    run = loop.ticks(*nominal(scenario.build_planner(), period), scenario.script(), period)
    return scenario, list(islice(run, TICKS))


def test_standing_feet_stand_and_swinging_feet_rise_between_their_footholds(ticks):
    scenario, run = ticks
    live = LiveFeet(scenario.planner.dt)
    feet = np.array([live.at(tick) for tick in run])
    standing = np.array([tick.plan.contacts[0] for tick in run])
    planned = np.array([tick.seen.feet for tick in run])
    np.testing.assert_array_equal(feet[standing], planned[standing])
    assert feet[~standing][:, 2].max() == pytest.approx(0.08, abs=0.02)
    # No foot jumps: 20 cm in a period would be 6 m/s.
    assert np.linalg.norm(np.diff(feet, axis=0), axis=-1).max() < 0.2


def test_a_live_recording_holds_bodies_plan_and_figures(ticks, tmp_path):
    pytest.importorskip("rerun", reason="the extra viz is not installed")
    from rerun.chunk import RrdReader

    from palanquin.sim.live_view import LiveView

    scenario, run = ticks
    path = tmp_path / "live.rrd"
    start = run[0].seen.bodies[0, :3]
    view = LiveView(scenario.scene, scenario.planner.dt, start, path, spawn=False)
    for tick in run:
        view.show(tick)
    view.close()
    found = {}
    for chunk in RrdReader(str(path)).stream():
        found.setdefault(str(chunk.entity_path), []).append(chunk.to_record_batch())
    expected = {"/world/payload", "/world/terrain", "/world/left/LF_calf", "/world/left/forces"}
    expected |= {"/plan/payload", "/plan/right", "/plan/right/footholds", "/solver/solve_ms"}
    assert expected <= set(found)
    positions = [
        position[0]
        for batch in found["/world/payload"]
        for name in batch.schema.names
        if name.endswith("translation")
        for position in batch.column(name).to_pylist()
    ]
    wanted = [tick.seen.bodies[0, :3] for tick in run]
    np.testing.assert_allclose(positions, wanted, atol=1e-6)
