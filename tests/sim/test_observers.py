"""Observers in physics: payloads and robots that weigh what nobody told, pushes while trotting."""

import numpy as np
import pytest

from palanquin.errors import ProblemError
from palanquin.problems import clm
from palanquin.sim.runs.hands_physics import held_scene
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import open_scenario
from palanquin.sim.scenarios.physical import physical
from palanquin.sim.scenarios.settings import ObserverSettings
from palanquin.sim.show import plots
from palanquin.sim.show.joint_motion import JointMotion
from palanquin.sim.show.recording import write_recording

TROT = physical(open_scenario("trot"))


def with_observers(scenario, observers):
    return scenario.changed(planner={**dict(scenario.planner), "observers": observers})


def standing(world, **fields):
    robots = [robot.changed(gait="stand") for robot in TROT.robots]
    command = {"type": "velocity", "steps": [{"vx": 0.0}]}
    return TROT.changed(robots=robots, command=command, world=world, duration=2.0, **fields)


def height_error(record):
    """Of the payload, at the end, m."""
    return float((record.bodies - record.references)[-1, 0, 2])


@pytest.mark.parametrize("mass", [10.0, 22.0])
def test_a_payloads_mass_is_found_and_its_height_kept(mass):
    record = run_scenario(standing({"payload_mass": mass}))
    assert outcome(record)["apparent_payload_mass_kg"] == pytest.approx(mass, rel=0.03)
    assert abs(height_error(record)) < 1e-3
    blind = run_scenario(with_observers(standing({"payload_mass": mass}), None))
    assert "observed_wrench" not in blind.more
    assert outcome(blind)["apparent_payload_mass_kg"] is None
    assert abs(height_error(blind)) > 5e-3


def test_no_more_is_believed_than_was_told():
    settings = {"payload": {"most_share": 0.1}}
    record = run_scenario(with_observers(standing({"payload_mass": 22.0}), settings))
    assert record.more["apparent_payload_mass"].max() == pytest.approx(17.6, abs=0.02)


def test_robots_that_weigh_more_are_found_out():
    scenario = standing({"robot_mass": 1.1})
    told, true = held_scene(TROT).model, held_scene(scenario).model
    for name in ("left/trunk", "right/LF_thigh"):
        assert true.body(name).mass[0] == pytest.approx(1.1 * told.body(name).mass[0])
        np.testing.assert_allclose(true.body(name).inertia, 1.1 * told.body(name).inertia)
    assert true.body("payload").mass[0] == told.body("payload").mass[0]
    record = run_scenario(scenario)
    more = 0.1 * 32.807 * 9.81
    np.testing.assert_allclose(record.more["observed_wrench"][-1, 1:, 2], -more, rtol=0.15)


def test_a_push_moves_the_payload_less_when_it_is_observed():
    push = {"body": "left", "force": [0, 120, 0], "start": 0.8, "duration": 0.8}
    scenario = TROT.changed(pushes=[push], duration=2.0)
    moved = []
    for observers in ({}, None):
        record = run_scenario(with_observers(scenario, observers))
        error = (record.bodies - record.references)[:, 0, :3]
        moved.append(np.linalg.norm(error[record.time > 0.8], axis=1).max())
        if observers is not None:
            observed = record.more["observed_wrench"][:, 1]
            assert 60 < observed[:, 1].max() <= 150.0
            assert np.linalg.norm(observed[-1, :3]) < 20.0
    assert moved[0] < 0.7 * moved[1]


def test_settings_reach_the_planner():
    settings = ObserverSettings.model_validate(
        {
            "robots": {"force": 1, "most_force": 2, "torque": 3, "most_torque": 4},
            "payload": {"force": 5, "most_share": 0.0, "torque": 6, "most_torque": 7},
        }
    )
    found = settings.observers(mass=10.0)
    assert found == clm.Observers(clm.Observer(1, 2, 3, 4), clm.Observer(5, 0, 6, 7))
    with pytest.raises(ProblemError, match=r"observers.robots.most_force is -1"):
        _ = clm.Observers(clm.Observer(1.0, -1.0)).core


def test_what_is_observed_is_shown(tmp_path):
    pytest.importorskip("rerun", reason="the extra viz is not installed")
    from rerun.chunk import RrdReader

    scenario = TROT.changed(duration=0.2)
    record = run_scenario(scenario)
    names = [plot.__name__ for plot in plots.plots_of(record)]
    assert names[1:3] == ["plot_observed_forces", "plot_apparent_mass"]
    motion = JointMotion(held_scene(scenario).scene, record.time, record.more["qpos"])
    write_recording(record, motion, tmp_path / "run.rrd")
    paths = {str(c.entity_path) for c in RrdReader(str(tmp_path / "run.rrd")).stream()}
    wanted = {"/control/left/observed/force_y", "/control/payload/observed/torque_z"}
    assert wanted | {"/control/payload/apparent_mass"} <= paths
