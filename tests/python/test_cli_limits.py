"""Whatever number or place an option is given: it is used, or refused by name before any work."""

import os
import re
from pathlib import Path
from typing import Annotated, get_origin, get_type_hints

import pytest
from typer.models import OptionInfo
from typer.testing import CliRunner

from palanquin.cli import app
from palanquin.cli.console import check_writable, prepare_folder, write_json
from palanquin.cli.default_command import DEFAULT

CASE = Path(__file__).parents[1] / "data" / "cases" / "stand.json"
NUMBER = re.compile(r"\bint\b|\bfloat\b")
NEEDED = {
    ("check",): ["cart_pole"],
    ("solve",): [str(CASE)],
    ("demo",): ["trot"],
    ("teleop",): ["trot"],
    ("bench", "qps"): [str(CASE.parent)],
}


def commands(group=app, words=()):
    """All commands of the package: the words that call each, and its function."""
    for command in group.registered_commands:
        name = command.name or command.callback.__name__
        yield words if name == DEFAULT else (*words, name), command.callback
    for part in group.registered_groups:
        yield from commands(part.typer_instance, (*words, part.name))


def options():
    """(words, option, type) of all options of all commands."""
    for words, function in commands():
        for name, hint in get_type_hints(function, include_extras=True).items():
            if get_origin(hint) is Annotated and isinstance(hint.__metadata__[0], OptionInfo):
                kind, info = hint.__origin__, hint.__metadata__[0]
                names = [n for n in (info.default, *(info.param_decls or ())) if isinstance(n, str)]
                yield words, (names or [f"--{name.replace('_', '-')}"])[0], str(kind)


NUMBERS = [(words, option, kind) for words, option, kind in options() if NUMBER.search(kind)]
PLACES = [
    (words, option)
    for words, option, _ in options()
    if option in ("--json", "--rrd", "--out", "--record")
]


def run(words, *options):
    return CliRunner().invoke(app, [*words, *NEEDED.get(tuple(words), []), *options])


def test_there_are_many():
    assert len(NUMBERS) > 25
    assert len(PLACES) > 15
    assert (("demo",), "--rate") in [(words, option) for words, option, _ in NUMBERS]


def refused(result, option):
    text = " ".join(result.output.split())
    assert result.exit_code == 2, (result.output, result.exception)
    assert option.strip("-").split("-")[-1] in text
    return text


@pytest.mark.parametrize(("words", "option", "kind"), NUMBERS)
def test_senseless_numbers_are_refused(words, option, kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    values = ["-1", "x", "", "99999999999999999999999999"]
    values += ["1.5"] if "int" in kind else ["nan", "inf", "-inf", "1e308"]
    for value in values:
        refused(run(words, option, value), option)


@pytest.mark.parametrize(
    ("words", "option", "value", "message"),
    [
        (["demo", "trot"], "--duration", "0.0001", "must have from 1 to 50000"),
        (["demo", "trot"], "--robots", "9", "robots: 9 must be from 1 to 4"),
        (["demo", "bar"], "--robots", "9", "robots: 9 must be from 2 to 6"),
        (["demo", "bar"], "--duration", "0.0001", "duration: 0.0001 s must be from 0.001"),
        (["demo", "bar"], "--delay", "0.0015", "sensors.delay: 0.0015 s must be whole"),
        (["demo", "bar"], "--velocity", "-0.5,0,9", "is over 1.5 m/s or 1.5 rad/s"),
        (["bench", "horizon"], "--robots", "17", "--robots 17: teams of 1 to 16"),
        (["bench", "horizon"], "--horizons", "0", "values must be at least 1"),
        (["bench", "horizon"], "--horizons", "99999", "values must be at most 1000"),
        (["bench", "horizon"], "--horizons", "5,,6", "integers separated by commas"),
        (["bench", "solver"], "--qp", "magic", "--qp 'magic' is unknown"),
        (["campaign", "bar"], "--suite", "moon", "suite: 'moon' is not one of"),
        (["campaign", "bar"], "--planners", ",", "planner: '' is not one of"),
        (["campaign", "hands"], "--suite", "moon", "suite: 'moon' is not one of"),
        (["campaign", "hands"], "--without", "luck", "without: 'luck' is not one of"),
        (["campaign", "hands"], "--at", "much", "could not convert"),
    ],
)
def test_values_are_refused_with_their_rule(words, option, value, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, [*words, option, value])
    assert result.exit_code == 2, result.output
    assert message in " ".join(result.output.split())


def test_a_bar_is_not_driven_off_its_ground(tmp_path):
    options = ["--terrain", "rough", "--velocity", "-0.5", "--out", str(tmp_path)]
    result = CliRunner().invoke(app, ["demo", "bar", *options])
    assert result.exit_code == 2
    assert "this cannot be: velocity: left is told to walk off its ground after" in " ".join(
        result.output.split()
    )


@pytest.mark.parametrize(("words", "option"), PLACES)
def test_unusable_places_are_refused(words, option, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    for place in ("/proc/none/x", "file/x", "/proc/x", "x" * 300):
        text = refused(run(words, option, place), option)
        assert option in text
        assert place[:20] in text


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="a full disk is a device of Linux")
def test_a_full_disk_is_named(tmp_path):
    with pytest.raises(ValueError, match="--json /dev/full: No space left on device"):
        write_json("--json", Path("/dev/full"), {"x": 1})
    result = run(["solve"], "--out", "/dev/full")
    assert "--out /dev/full: No space left on device" in " ".join(result.output.split())
    assert result.exit_code == 2


def test_a_look_at_a_place_leaves_no_trace(tmp_path):
    check_writable("--json", tmp_path / "new.json")
    kept = tmp_path / "kept.json"
    kept.write_text("kept")
    check_writable("--json", kept)
    prepare_folder("--out", tmp_path / "deep" / "er")
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["deep", "er", "kept.json"]
    assert kept.read_text() == "kept"
