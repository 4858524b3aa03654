"""`palanquin teleop` at a pseudo-terminal: keys drive a team, and the session can be replayed."""

import contextlib
import json
import os
import pty
import select
import subprocess
import sys
import time

import pytest
from typer.testing import CliRunner

from palanquin.cli import app

COMMAND = [sys.executable, "-c", "from palanquin.cli import app; app()", "teleop"]


class Terminal:
    """A command that believes to run in a terminal."""

    def __init__(self, *arguments):
        self._main, worker = pty.openpty()
        environment = {**os.environ, "TERM": "xterm", "COLUMNS": "120", "LINES": "40"}
        self.process = subprocess.Popen(
            [*COMMAND, *map(str, arguments)],
            stdin=worker,
            stdout=worker,
            stderr=worker,
            env=environment,
        )
        os.close(worker)
        self.text = ""

    def read_until(self, text, seconds=60.0):
        """Waits for `text` on the screen."""
        deadline = time.monotonic() + seconds
        while text not in self.text:
            assert time.monotonic() < deadline, self.text[-2000:]
            if select.select([self._main], [], [], 0.1)[0]:
                try:
                    self.text += os.read(self._main, 65536).decode(errors="replace")
                except OSError:  # the command has ended
                    assert text in self.text, self.text[-2000:]

    def press(self, *keys):
        for key in keys:
            os.write(self._main, key)

    def wait(self):
        """Exit status, with the rest of the output read."""
        with contextlib.suppress(AssertionError, OSError):
            self.read_until("no such text", seconds=0.5)
        status = self.process.wait(timeout=30)
        os.close(self._main)
        return status


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    folder = tmp_path_factory.mktemp("teleop")
    told = "--tracking", "kinematic", "--record", folder / "commands.jsonl"
    terminal = Terminal("trot", "--headless", *told)
    terminal.read_until("up, down")
    for key, seen in ((b"\x1b[A", "vx 0.05"), (b"\x1b[C", "wz -0.05"), (b"6", "crawl, right")):
        terminal.press(key)
        terminal.read_until(seen)
    terminal.press(b"p")
    terminal.read_until("right is pushed with 100 N")
    terminal.press(b" ")
    terminal.read_until("vx 0.00 m/s, vy 0.00 m/s, wz 0.00", seconds=20)
    terminal.press(b"q")
    terminal.read_until(" fallbacks")
    return terminal.wait(), terminal.text, folder / "commands.jsonl"


def test_keys_drive_a_team(session):
    status, text, _ = session
    assert status == 0, text[-2000:]
    assert "no display" in text


def test_the_session_is_recorded_and_drives_a_demo(session, tmp_path):
    lines = [json.loads(line) for line in session[2].read_text().splitlines()]
    assert next(line["velocity"]["vx"] for line in lines if "velocity" in line) == 0.05
    assert [line["gait"]["gait"]["name"] for line in lines if "gait" in line] == ["crawl"]
    assert [line["push"]["body"] for line in lines if "push" in line] == ["right"]
    assert lines[-1]["end"] > lines[-2]["time"]
    figures = tmp_path / "figures.json"
    arguments = ["demo", "trot", "--commands", session[2], "--headless", "--no-video"]
    arguments += ["--tracking", "kinematic"]  # as it was driven
    result = CliRunner().invoke(
        app, [*map(str, arguments), "--out", str(tmp_path), "--json", str(figures)]
    )
    assert result.exit_code == 0, result.output
    assert json.loads(figures.read_text())["duration_s"] == pytest.approx(lines[-1]["end"])


@pytest.mark.parametrize(("tracking", "plans"), [(None, 50), ("kinematic", 15)])
def test_recorded_commands_need_no_terminal(tmp_path, tracking, plans):
    path = tmp_path / "commands.jsonl"
    path.write_text(
        '{"palanquin": "commands", "version": 1}\n'
        '{"time": 0.1, "velocity": {"vx": 0.2, "vy": 0.0, "wz": 0.0}}\n'
        '{"end": 0.5}\n'
    )
    rrd = tmp_path / "live.rrd"
    arguments = ["teleop", "trot", "--commands", path, "--headless", "--rrd", rrd]
    arguments += ["--tracking", tracking] if tracking else []
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.output
    assert f"0.5 s, {plans} plans" in result.output
    if "pip install" not in result.output:
        assert rrd.stat().st_size > 10_000


def test_robots_on_bars_are_driven_one_by_one(tmp_path):
    live, told = tmp_path / "live.rrd", tmp_path / "commands.jsonl"
    terminal = Terminal("bar", "--headless", "--rrd", live, "--record", told)
    terminal.read_until("whom to drive")
    terminal.press(b"\t")
    terminal.read_until("trot, left")
    terminal.press(b"\x1b[A")
    terminal.read_until("vx 0.05")
    terminal.press(b"q")
    terminal.read_until(" fallbacks")
    assert terminal.wait() == 0
    assert live.stat().st_size > 10_000
    lines = [json.loads(line) for line in told.read_text().splitlines()]
    assert lines[1]["velocity"] == {"vx": 0.05, "vy": 0.0, "wz": 0.0, "robots": ["left"]}
    arguments = ["demo", "bar", "--commands", told, "--headless", "--no-video", "--out", tmp_path]
    result = CliRunner().invoke(app, [*map(str, arguments)])
    assert result.exit_code == 0, result.output
    figures = json.loads((tmp_path / "bar" / "bar.json").read_text())
    assert figures["duration_s"] == pytest.approx(lines[-1]["end"], abs=0.006)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["bar", "--commands", "x.jsonl"], "x.jsonl: No such file"),
        (["fly"], "scenario: 'fly' is not known"),
        (["trot"], "standard input is none; `--commands FILE` needs no keys"),
        (["trot", "--commands", "none.jsonl"], "none.jsonl: No such file"),
        (["trot", "--record", "/none/file"], "there is no folder /none"),
    ],
)
def test_bad_input_is_refused(arguments, message):
    result = CliRunner().invoke(app, ["teleop", *arguments, "--headless"])
    assert result.exit_code == 2
    assert message in " ".join(result.output.split())
