"""What planner and controllers know: the state, the state with noise, or an estimate of it."""

import numpy as np
import pytest

from palanquin.sim.errors import InputError
from palanquin.sim.runs.hands_physics import held_scene
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.run_outcome import outcome, payload_error
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.runs.tracking import estimation_error
from palanquin.sim.scenarios import load_scenario, open_scenario
from palanquin.sim.scenarios.physical import physical
from palanquin.sim.scenarios.sensing import BaseNoise, Encoders, Imu, Place, Sensing
from palanquin.sim.show.joint_motion import JointMotion
from palanquin.sim.show.plots import draw_plots, plot_estimation, plot_known_force, plots_of
from palanquin.sim.show.recording import write_recording

TROT = physical(open_scenario("trot"))
DURATION = 3.0


def known(state, duration=DURATION, **sensors):
    return TROT.changed(state=state, duration=duration, sensors=sensors)


@pytest.fixture(scope="module", params=["noisy", "estimated"])
def record(request):
    return run_scenario(known(request.param))


def test_a_team_walks_by_what_it_knows(record):
    figures = outcome(record)
    assert figures["completed"]
    assert record.true_bodies[-1, 0, 0] == pytest.approx(0.4 * DURATION, abs=0.05)
    assert figures["payload_position_error_m"]["rms"] < 5e-3
    for who in ("payload", "robots"):
        error = figures["estimation_error"][who]
        assert 2e-4 < error["position_rms"] < 6e-3
        assert 2e-4 < error["orientation_rms"] < 1e-2
        assert 1e-3 < error["velocity_rms"] < 6e-2
        assert error["position_max"] > error["position_rms"]


def test_a_record_keeps_what_was_hidden(record, tmp_path):
    address = int(held_scene(TROT).model.joint("payload").qposadr[0])
    free = record.more["qpos"][:, address : address + 7]
    np.testing.assert_allclose(record.true_bodies[:, 0, :7], free, atol=1e-12)
    assert np.abs(record.bodies[:, 0, :3] - free[:, :3]).max() > 1e-4
    assert np.abs(record.feet - record.true_feet).max() > 1e-4
    record.save(tmp_path / "run.npz")
    again = Record.load(tmp_path / "run.npz")
    np.testing.assert_array_equal(again.true_bodies, record.true_bodies)


def test_the_payloads_error_is_that_of_the_payload_as_it_is(record):
    before = payload_error(record)
    believed = record.x.copy()
    record.x[:] = record.reference
    assert payload_error(record) == before
    record.x[:] = believed


def test_robots_know_the_forces_on_their_feet(record):
    known, true = record.more["known_force"], record.more["foot_force"]
    assert np.sqrt(((known - true) ** 2).mean() / (true**2).mean()) < 0.3


def test_plots_and_recordings_show_what_was_believed(record, tmp_path):
    assert {plot_estimation, plot_known_force} <= set(plots_of(record))
    draw_plots(record, tmp_path / "plots.png")
    pytest.importorskip("rerun", reason="the extra viz is not installed")
    from rerun.chunk import RrdReader

    motion = JointMotion(held_scene(TROT).scene, record.time, record.more["qpos"])
    write_recording(record, motion, tmp_path / "run.rrd")
    chunks = RrdReader(str(tmp_path / "run.rrd")).stream()
    paths = {str(chunk.entity_path) for chunk in chunks}
    expected = {"/estimate/payload", "/control/left/estimate/position_error"}
    assert expected | {"/control/right/foot_force/LF/known"} <= paths


def test_who_knows_the_state_hides_nothing():
    record = run_scenario(TROT.changed(duration=0.2))
    assert "true_bodies" not in record.more
    assert record.true_bodies is not None
    assert estimation_error(record).position.max() == 0
    assert "estimation_error" not in outcome(record)


def error_after(seconds, **sensors):
    record = run_scenario(known("estimated", seconds, **sensors))
    return estimation_error(record).position[:, 1:].max()


def test_without_fixes_of_the_place_the_team_drifts():
    drift = error_after(2.0, place={"rate": 0.0})
    assert error_after(2.0) < drift < 0.1


def test_perfect_sensors_leave_little_to_estimate():
    assert error_after(1.0, noise=0.0) < 2e-3


def test_a_seed_draws_the_noise():
    def first(seed, state):
        return run_scenario(known(state, 0.05).changed(seed=seed)).x[2]

    for state in ("noisy", "estimated"):
        np.testing.assert_array_equal(first(1, state), first(1, state))
        assert (first(1, state) != first(2, state)).any()


def test_the_two_robots_have_noise_of_their_own():
    record = run_scenario(known("noisy", 0.05))
    error = (record.bodies - record.true_bodies)[:, 1:, 2]
    assert (error[:, 0] != error[:, 1]).all()


# field: what becomes of it in C++, if it is noise times 3
OF_NOISE = {
    **{("base", name): name for name in BaseNoise.model_fields},
    ("encoders", "position"): "joint_position",
    ("encoders", "velocity"): "joint_velocity",
}
OF_SENSORS = {
    **{("imu", name): name for name in Imu.model_fields},
    ("encoders", "position"): "joint_position",
    ("encoders", "velocity"): "joint_velocity",
    ("place", "position"): "place_position",
    ("place", "heading"): "place_heading",
}


def test_the_tables_have_every_field():
    assert {name for group, name in OF_NOISE if group == "base"} == set(BaseNoise.model_fields)
    assert {"position", "velocity", "resolution"} == set(Encoders.model_fields)
    assert {"rate", "position", "heading", "latency"} == set(Place.model_fields)
    groups = {"base", "encoders", "imu", "place"}
    assert groups | {"noise", "delay", "contact"} == set(Sensing.model_fields)


@pytest.mark.parametrize(("group", "name"), OF_NOISE)
def test_noise_reaches_the_noisy_state(group, name):
    sensing = Sensing(**{group: {name: 0.125}}, noise=3.0)
    settings = sensing.measurement(7)
    assert getattr(settings, OF_NOISE[group, name]) == 0.375
    assert settings.seed == 7


@pytest.mark.parametrize(("group", "name"), OF_SENSORS)
def test_noise_reaches_the_sensors(group, name):
    settings = Sensing(**{group: {name: 0.125}}, noise=3.0).estimation(7).sensors
    assert getattr(settings, OF_SENSORS[group, name]) == 0.375
    assert settings.seed == 7


def test_what_is_no_noise_reaches_sensors_and_estimator():
    sensing = Sensing(
        delay=0.003,
        encoders={"resolution": 0.01},
        place={"rate": 25.0, "latency": 0.04},
        contact="feet",
        noise=3.0,
    )
    assert sensing.measurement(0).delay == 3
    settings = sensing.estimation(0)
    assert settings.sensors.joint_resolution == 0.01
    assert (settings.sensors.place_rate, settings.sensors.place_latency) == (25.0, 0.04)
    assert settings.feels_feet
    assert not Sensing().estimation(0).feels_feet
    assert settings.estimator.joint_position == 0.01


@pytest.mark.parametrize("name", ["gyro", "accelerometer", "gyro_walk", "accelerometer_walk"])
def test_an_estimator_knows_how_bad_its_sensors_are(name):
    trust = Sensing(imu={name: 0.5}).estimation(0).estimator
    assert getattr(trust.base, name) == 0.5


@pytest.mark.parametrize("state", ["true", "noisy", "estimated"])
def test_a_file_says_what_is_known(state, tmp_path):
    text = f"robots: [{{name: left, attach: [0, 1, 0]}}]\nstate: {state}\n"
    text += "command: {type: velocity, steps: [{vx: 0.1}]}\n"
    file = tmp_path / "walk.yaml"
    file.write_text(text)
    assert load_scenario(file).state == state


def test_a_kinematic_run_has_no_sensors():
    with pytest.raises(InputError, match="a kinematic run has no sensors"):
        open_scenario("trot").changed(tracking="kinematic", state="noisy")
