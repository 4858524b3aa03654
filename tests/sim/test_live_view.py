"""The live view: what it logs of a run while it goes on."""

from itertools import islice

import numpy as np
import pytest

from palanquin.sim.runs.scenarios import loop_of
from palanquin.sim.scenarios import BarScenario, open_scenario
from palanquin.sim.show.live_stage import stage_of
from palanquin.sim.show.live_swing import LiveFeet

TICKS = 20
BARS = BarScenario()
REDUCED = BarScenario(tracking="reduced")


@pytest.fixture(scope="module")
def ticks():
    scenario = open_scenario("trot")
    return scenario, list(islice(loop_of(scenario).ticks(), TICKS))


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


def logged(scenario, run, path):
    """Entities of a live recording by their paths."""
    pytest.importorskip("rerun", reason="the extra viz is not installed")
    from rerun.chunk import RrdReader

    from palanquin.sim.show.live_view import LiveView

    view = LiveView(stage_of(scenario), path, spawn=False)
    for tick in run:
        view.show(tick)
    view.close()
    found = {}
    for chunk in RrdReader(str(path)).stream():
        found.setdefault(str(chunk.entity_path), []).append(chunk.to_record_batch())
    return found


def positions(batches):
    return [
        position[0]
        for batch in batches
        for name in batch.schema.names
        if name.endswith("translation")
        for position in batch.column(name).to_pylist()
    ]


def test_a_live_recording_holds_bodies_plan_and_figures(ticks, tmp_path):
    scenario, run = ticks
    found = logged(scenario, run, tmp_path / "live.rrd")
    expected = {"/world/payload", "/world/terrain", "/world/left/LF_calf", "/world/left/forces"}
    expected |= {"/plan/payload", "/plan/right", "/plan/right/footholds", "/solver/solve_ms"}
    assert expected <= set(found)
    wanted = [tick.seen.bodies[0, :3] for tick in run]
    np.testing.assert_allclose(positions(found["/world/payload"]), wanted, atol=1e-6)


@pytest.mark.parametrize("scenario", [BARS, REDUCED], ids=["physics", "reduced"])
def test_robots_on_bars_are_shown_too(scenario, tmp_path):
    run = list(islice(loop_of(scenario).ticks(), TICKS))
    found = logged(scenario, run, tmp_path / "live.rrd")
    expected = {"/world/left/trunk", "/world/bar1", "/world/ground/surface", "/world/left/forces"}
    expected |= {"/plan/left", "/plan/right/footholds", "/solver/solve_ms"}
    expected |= {"/solver/violation/friction"}
    assert expected <= set(found), sorted(expected - set(found))
    shown = positions(found["/world/bar1"])
    assert len(shown) == 6  # in 0.1 s of 200 ticks a second
    middle = run[0].seen.bodies[:, :3].mean(axis=0) + np.array([0, 0, 0.15])
    np.testing.assert_allclose(shown[0], middle, atol=0.01)
