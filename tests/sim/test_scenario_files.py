"""Scenario files: what is wrong with one stands in the message with its line."""

import numpy as np
import pytest

from palanquin.sim.scenarios import ScenarioError, ScenarioFile, load_scenario

GOOD = """\
robots:
  - {name: left, attach: [0, 0.6, 0]}
  - name: right
    attach: [0, -0.6, 0]
    gait: {name: trot, period: 5e-1}
payload: {mass: 10}
command: {type: velocity, steps: [{vx: 0.4}]}
"""


@pytest.fixture
def load(tmp_path):
    def load(text):
        path = tmp_path / "mine.yaml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return load_scenario(path)

    return load


def test_a_file_needs_no_name_of_its_own(load):
    scenario = load(GOOD)
    assert scenario.name == "mine"
    assert scenario.robots[1].gait.gait.period == 0.5
    assert scenario.robots[0].gait.name == "trot"


@pytest.mark.parametrize(
    ("file", "name"),
    [
        ("my walk.yaml", "my-walk"),
        ("2 robots.yaml", "scenario-2-robots"),
        ("\u00fcber den Berg!.yaml", "ber-den-Berg"),
        ("\u5c71.yaml", "scenario"),
        ("a" * 60 + ".yaml", "a" * 40),
        ("v1.2.yaml", "v1-2"),
    ],
)
def test_a_file_may_have_any_name(tmp_path, file, name):
    path = tmp_path / file
    path.write_text(GOOD)
    assert load_scenario(path).name == name


def test_a_height_map_lies_beside_the_file_that_names_it(tmp_path, monkeypatch):
    folder, elsewhere = tmp_path / "runs", tmp_path / "elsewhere"
    (folder / "maps").mkdir(parents=True)
    elsewhere.mkdir()
    np.save(folder / "maps" / "hill.npy", np.full((5, 5), 0.25))
    path = folder / "mine.yaml"
    path.write_text(GOOD + "terrain: {type: height_map, file: maps/hill.npy}\n")
    for place, name in ((elsewhere, path), (folder, path.name), (tmp_path, "runs/mine.yaml")):
        monkeypatch.chdir(place)
        scenario = load_scenario(name)
        monkeypatch.chdir(elsewhere)
        assert scenario.changed(duration=2.0).ground.height(0.1, 0.1) == pytest.approx(0.25)
        assert scenario.scene.ground.height(0.1, 0.1) == pytest.approx(0.25)
    np.save(elsewhere / "hill.npy", np.zeros((5, 5)))
    path.write_text(GOOD + "terrain: {type: height_map, file: hill.npy}\n")
    with pytest.raises(ScenarioError, match=r"mine.yaml:8: terrain: .*runs/hill.npy: not a height"):
        load_scenario(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n", None),
        ("x0: &x0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n"
         + "".join(f"x{i}: &x{i} [{', '.join([f'*x{i - 1}'] * 10)}]\n" for i in range(1, 9)),
         "more than 1000000 values"),
        ("<<: &m {mas: 3}\n", "mine.yaml:1: unknown key 'mas'"),
        ("payload: !!set {mass}\n", "mine.yaml:.: payload: "),
        ("duration: !!binary aGVsbG8=\n", "mine.yaml:.: duration: "),
        ("duration: 2001-01-01\n", "mine.yaml:.: duration: "),
        ("duration: 1e308\n", "duration: is 1e.308; its magnitude must be at most 1e.12"),
        ("duration: 1e-300\n", "mine.yaml:.: duration: is 1e-300; it must be at least 1e-12"),
        (f"duration: {10**30}\n", "mine.yaml:.: duration: "),
    ],
)  # fmt: skip
def test_odd_yaml_is_refused_in_words(load, text, message):
    with pytest.raises(ScenarioError, match=message or "unknown key 'a'"):
        load(GOOD.replace("payload: {mass: 10}\n", "") + text)


def test_json_is_yaml(load):
    scenario = load(GOOD)
    assert load(scenario.model_dump_json(indent=1)) == scenario


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mass: 10", "mas: 10", r"mine.yaml:6: payload: unknown key 'mas'; valid keys are mass, "),
        ("mass: 10", "mass: heavy", r"mine.yaml:6: payload.mass: is 'heavy'; input should be"),
        ("mass: 10", "mass: .nan", r"mine.yaml:6: payload.mass: is nan"),
        ("mass: 10", "mass: on", r"mine.yaml:6: payload.mass: is 'on'"),
        ("mass: 10", "mass: true", r"mine.yaml:6: payload.mass: is True"),
        ("-0.6, 0]", "-0.6]", r"mine.yaml:4: robots\[1\].attach\[2\]: is missing"),
        ("-0.6, 0]", "x, 0]", r"mine.yaml:4: robots\[1\].attach\[1\]: is 'x'"),
        ("name: trot", "name: hop", r"mine.yaml:5: robots\[1\].gait: gait 'hop' is unknown"),
        ("    attach: [0, -0.6, 0]\n", "", r"mine.yaml:3: robots\[1\].attach: is missing"),
        ("name: right", "name: left", r"mine.yaml:1: robots: names \['left', 'left'\] must differ"),
        ("name: right", "name: a/b", r"mine.yaml:3: robots\[1\].name: is 'a/b'"),
        ("payload", "mass: 10\npayload", r"mine.yaml:1: unknown key 'mass'; valid keys are name"),
        ("payload", "robots: 3\npayload", r"mine.yaml:6: not YAML: .* duplicate key"),
        ("{vx: 0.4}]}", "{vx: 0.4", r"mine.yaml:8: not YAML: "),
        ("{mass: 10}", "&a {mass: *a}", r"refers to itself|mine.yaml:6"),
    ],
)
def test_a_fault_is_named_with_its_line(load, old, new, message):
    assert old in GOOD
    with pytest.raises(ScenarioError, match=message):
        load(GOOD.replace(old, new, 1))


def test_every_fault_is_listed(load):
    with pytest.raises(ScenarioError) as error:
        load(GOOD.replace("mass: 10", "mass: 0").replace("vx: 0.4", "vx: fast"))
    assert [line.split(":")[1] for line in str(error.value).splitlines()] == ["6", "7"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "a mapping with keys"),
        ("- 1\n", "a mapping with keys"),
        ("robots", "a mapping with keys"),
        (b"\xff\xfe\x00", "not a text file in UTF-8"),
        ("a: \x00", "not YAML"),
        ("{" * 5000, "nested too deeply|not YAML"),
        ("a: 1\n---\nb: 2\n", "not YAML"),
        ("a:\n  ? : {b: 1}\n", "a key must be a word"),
        ("!!python/object/apply:os.system ['true']", "a mapping with keys|not YAML"),
    ],
)
def test_garbage_is_refused(load, text, message):
    with pytest.raises(ScenarioError, match=message):
        load(text)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(ScenarioError, match="No such file"):
        load_scenario(tmp_path / "none.yaml")
    with pytest.raises(ScenarioError, match="Is a directory"):
        load_scenario(tmp_path)


def test_a_field_that_is_not_in_the_file_has_the_line_of_what_holds_it(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(GOOD)
    file = ScenarioFile(path)
    assert file.described(("payload", "inertia"), "odd") == f"{path}:6: payload.inertia: odd"
    assert file.described(("robots", 1, "attach"), "odd") == f"{path}:4: robots[1].attach: odd"
    assert file.described(("duration",), "odd") == f"{path}:1: duration: odd"
