"""Key presses become orders, and a session's orders become a file that replays it exactly."""

import numpy as np
import pytest

from palanquin.problems.planning import Velocity
from palanquin.sim.runs.scenarios import loop_of, run_scenario
from palanquin.sim.scenarios import BarScenario, open_scenario
from palanquin.sim.scenarios.pilot import GAITS, Pilot
from palanquin.sim.scenarios.recorded import (
    CommandFileError,
    CommandRecorder,
    replayed,
    replayed_on_bars,
)

TROT = open_scenario("trot")
PERIOD = TROT.planner.period
POSE = np.zeros(3)
HEADER, END = '{"palanquin": "commands", "version": 1}', '{"end": 2.0}'


@pytest.fixture
def pilot():
    return Pilot.of(TROT)


def press(pilot, *keys):
    for key in keys:
        pilot.press(key)


def test_keys_change_the_velocity_and_space_stops(pilot):
    press(pilot, "up", "up", "a", "left", "down")
    assert pilot.at(0.0, POSE, PERIOD).velocity == Velocity(0.05, 0.05, 0.05)
    press(pilot, "d", "right", "space")
    assert pilot.at(0.1, POSE, PERIOD).velocity == Velocity()


def test_velocities_have_limits(pilot):
    press(pilot, *["up"] * 40, *["d"] * 40, *["right"] * 40)
    assert pilot.velocities == [Velocity(0.8, -0.4, -0.5)]


def test_a_gait_is_ordered_once(pilot):
    press(pilot, "6")
    (change,) = pilot.at(2.0, POSE, PERIOD).gait_changes
    assert (change.gait.name, change.robots) == ("crawl", ())
    assert pilot.at(2.1, POSE, PERIOD).gait_changes == ()


def test_who_stands_does_not_walk(pilot):
    press(pilot, "up", "1", "up")
    assert "standing: choose a gait" in pilot.note
    assert pilot.at(0.0, POSE, PERIOD).velocity == Velocity()
    press(pilot, "2", "up")
    assert pilot.note == ""
    assert pilot.velocities == [Velocity(0.05)]


def test_pushes_are_sideways_to_the_heading(pilot):
    press(pilot, "tab", "p", "o")
    left, right = pilot.at(1.5, np.array([0.0, 0.0, np.pi / 2]), PERIOD).pushes
    assert (left.body, right.body) == ("payload", "payload")
    np.testing.assert_allclose(left.force, [-100.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(right.force, [100.0, 0.0, 0.0], atol=1e-12)
    assert left.start == 1.5
    assert len(pilot.at(1.6, POSE, PERIOD).pushes) == 2  # they last


def test_other_keys_do_nothing(pilot):
    press(pilot, "x", "", "9", "f1", "é")
    orders = pilot.at(0.0, POSE, PERIOD)
    assert (orders.velocity, orders.gait_changes, orders.pushes) == (Velocity(), (), ())
    assert not pilot.has_quit
    press(pilot, "q")
    assert pilot.at(0.0, POSE, PERIOD) is not None  # a run has one tick at least
    assert pilot.at(0.1, POSE, PERIOD) is None


def test_the_help_names_every_gait_and_who_can_be_pushed(pilot):
    assert ", ".join(GAITS) in dict(pilot.keys)["1 to 6"]
    assert "p, o" in dict(pilot.keys)
    assert "p, o" not in dict(Pilot.of(BarScenario()).keys)


def test_keys_drive_all_robots_on_bars_or_one():
    pilot = Pilot.of(BarScenario())
    press(pilot, "up", "up", "left")
    assert pilot.velocities == [Velocity(0.1, 0.0, 0.05)] * 2
    press(pilot, "tab", "tab", "down", "p", "x")
    assert pilot.velocities == [Velocity(0.1, 0.0, 0.05), Velocity(0.05, 0.0, 0.05)]
    assert pilot.described() == "right, trot: 0.05 m/s, 0.00 m/s, 0.05 rad/s"
    assert pilot.at(0.0, POSE, PERIOD).pushes == ()
    press(pilot, "tab", "space")
    assert pilot.velocities == [Velocity()] * 2
    press(pilot, *["up"] * 20, *["a"] * 20, *["right"] * 20)
    assert pilot.velocities == [Velocity(0.6, 0.2, -0.4)] * 2


def test_a_run_on_bars_follows_the_keys_and_ends_with_q():
    scenario = BarScenario(duration=5.0)
    pilot, keys = Pilot.of(scenario), iter(["x", "x", "up", "x", "x", "q"])

    class Keys:
        def at(self, time, pose, period):
            pilot.press(next(keys))
            return pilot.at(time, pose, period)

    result = run_scenario(scenario, director=Keys())
    assert result.duration == pytest.approx(5 * 0.005)
    assert result.references[:, 0, 7] == pytest.approx([0, 0, 0.05, 0.05, 0.05])


PRESSES = {3: ["up", "up", "left"], 10: ["3"], 20: ["p"], 25: ["tab", "o", "space"], 40: ["up"]}


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """Bodies at every tick of a session at the keyboard, and its file."""
    path = tmp_path_factory.mktemp("session") / "commands.jsonl"
    pilot, bodies = Pilot.of(TROT), []
    with CommandRecorder(pilot, path) as director:
        for n, tick in enumerate(loop_of(TROT, director=director).ticks()):
            bodies.append(tick.seen.bodies.ravel())
            press(pilot, *PRESSES.get(n, []))
            if n == 59:
                break
    return np.array(bodies), path


def test_a_replayed_session_is_the_same_to_the_last_bit(session):
    bodies, path = session
    scenario = replayed(TROT, path)
    assert scenario.duration == pytest.approx(60 * PERIOD)
    assert [change.gait.name for change in scenario.gait_changes] == ["pace"]
    assert [push.body for push in scenario.pushes] == ["right", "payload"]
    rollout = run_scenario(scenario)
    np.testing.assert_array_equal(rollout.x, bodies)
    assert np.ptp(rollout.x[:, 0]) > 0.02


def test_a_session_on_bars_is_replayed_to_the_last_bit(tmp_path):
    path, scenario = tmp_path / "commands.jsonl", BarScenario(tracking="reduced")
    presses = {10: ["up"], 30: ["tab", "up", "left"], 60: ["2"], 80: ["space"]}
    pilot, bodies = Pilot.of(scenario), []
    with CommandRecorder(pilot, path, scenario.names) as director:
        for n, tick in enumerate(loop_of(scenario, director=director).ticks()):
            bodies.append(tick.seen.bodies)
            press(pilot, *presses.get(n, []))
            if n == 99:
                break
    again = replayed_on_bars(scenario, path)
    assert [c.robots for c in again.velocity_changes] == [(), ("left",), ("left",)]
    assert [c.gait.name for c in again.gait_changes] == ["trot"]
    record = run_scenario(again)
    np.testing.assert_array_equal(record.bodies, bodies)
    assert np.ptp(record.bodies[:, :, 0], axis=0).min() > 1e-3


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('{"time": 1, "push": {"body": "left", "force": [1, 0, 0], "duration": 1}}', "not pushed"),
        ('{"time": 1, "velocity": {"vx": 9, "vy": 0, "wz": 0}}', "over 1.5 m/s"),
        (
            '{"time": 1, "velocity": {"vx": 0, "vy": 0, "wz": 0, "robots": ["me"]}}',
            "'me' is not one of left, right",
        ),
    ],
)
def test_commands_that_bars_cannot_take_are_refused(tmp_path, line, message):
    path = tmp_path / "commands.jsonl"
    path.write_text("\n".join([HEADER, line, END]) + "\n")
    with pytest.raises(CommandFileError, match=message):
        replayed_on_bars(BarScenario(), path)


def test_a_velocity_of_one_robot_is_not_for_hands(tmp_path):
    path = tmp_path / "commands.jsonl"
    line = '{"time": 1, "velocity": {"vx": 0, "vy": 0, "wz": 0, "robots": ["left"]}}'
    path.write_text("\n".join([HEADER, line, END]) + "\n")
    with pytest.raises(CommandFileError, match="a payload in hands has one for all"):
        replayed(TROT, path)


def test_a_file_cut_anywhere_is_refused(session, tmp_path):
    whole = session[1].read_bytes()
    path = tmp_path / "cut.jsonl"
    last_line = whole.rstrip(b"\n").rfind(b"\n")
    for length in {*range(0, last_line + 2, 7), last_line, last_line + 1, last_line + 5}:
        path.write_bytes(whole[:length])
        with pytest.raises(CommandFileError, match=r"cut off|is empty|not JSON"):
            replayed(TROT, path)
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(CommandFileError, match=r"cut.jsonl:\d+: the file is cut off: its last"):
        replayed(TROT, path)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (['{"palanquin": "rollout", "version": 1}', END], r":1: palanquin: is 'rollout'"),
        (['{"palanquin": "commands", "version": 2}', END], r":1: version: is 2"),
        (["[1, 2]", END], r":1: "),
        ([HEADER, "hello", END], r":2: not JSON"),
        ([HEADER, '{"time": 1}', END], r":2: exactly one of velocity, gait, push is needed"),
        ([HEADER, '{"time": 1, "speed": 2}', END], r":2: unknown key 'speed'; valid keys are time"),
        ([HEADER, '{"time": 1, "velocity": {"vx": 1}}', END], r":2: velocity.vy: is missing"),
        (
            [HEADER, '{"time": 1, "velocity": {"vx": NaN, "vy": 0, "wz": 0}}', END],
            r":2: velocity.vx: is nan",
        ),
        (
            [HEADER, '{"time": 3, "gait": {"gait": "pace"}}', END],
            r":2: time 3 s must be from 0 s, the line before's, to 2 s, the end's",
        ),
        (
            [HEADER, '{"time": 1, "gait": {"gait": "hop"}}', END],
            r":2: gait.gait: gait 'hop' is unk",
        ),
        (
            [HEADER, '{"time": 1, "push": {"body": "z", "force": [1, 0, 0], "duration": 1}}', END],
            r"not for scenario 'trot': pushes\[0\].body: 'z' is not one of",
        ),
        ([HEADER, '{"end": -1}'], r":2: end: is -1"),
    ],
)
def test_bad_command_files_are_refused(tmp_path, lines, message):
    path = tmp_path / "commands.jsonl"
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(CommandFileError, match=message):
        replayed(TROT, path)


def test_files_that_are_none_are_refused(tmp_path):
    with pytest.raises(CommandFileError, match="No such file"):
        replayed(TROT, tmp_path / "none")
    path = tmp_path / "binary"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(CommandFileError, match="UTF-8"):
        replayed(TROT, path)
