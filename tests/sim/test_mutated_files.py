"""Files with mistakes in them are used or refused in words; nothing else ever happens."""

import io
import json
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from pydantic import ValidationError
from ruamel.yaml import YAML
from support.mutations import RUNS, garbled, mutated

from palanquin.errors import PalanquinError, ProblemError
from palanquin.problems.case_files import CaseError, read_case
from palanquin.problems.clm import parse_case
from palanquin.problems.clm.case_problem import CaseProblem
from palanquin.problems.height_map_files import read_heights
from palanquin.problems.layered.case import load_layered_case
from palanquin.problems.rough_kinds import HeightMapKind
from palanquin.sim.feasibility import findings
from palanquin.sim.runs.store import RowStore
from palanquin.sim.scenarios import SHIPPED, ScenarioError, ScenarioFile, load_scenario
from palanquin.sim.scenarios.recorded import CommandFileError, replayed

DATA = Path(__file__).parents[1] / "data"
EVERYTHING = {
    "summary": "every kind of field",
    "duration": 5.0,
    "seed": 1,
    "robots": [
        {
            "name": "left", "model": "a1", "attach": [0, 0.6, 0], "yaw": 0.1,
            "gait": {"name": "own", "period": 0.5, "duty": 0.6, "offset": [0, 0.5, 0.5, 0]},
        },
        {"name": "right", "arm": "dynaarm", "attach": [0, -0.6, 0]},
    ],
    "payload": {
        "mass": 10.0, "height": 0.45,
        "shape": {"type": "cylinder", "radius": 0.05, "length": 2.5, "axis": "y"},
    },
    "terrain": {
        "type": "height_map", "origin": [-3, -3], "spacing": 6,
        "heights": [[0, 0, 0.1, 0.1], [0, 0.02, 0.08, 0.1]],
    },
    "ditches": {"type": "lines", "lines": [{"a": 1, "b": 0.2, "c": -1.2, "d": 0.2}]},
    "obstacles": [
        {"type": "box", "centre": [5, 5], "size": [1, 1], "yaw": 0.2},
        {"type": "wall", "start": [4, -3], "end": [4, -4]},
        {"type": "cylinder", "centre": [3, 3], "radius": 0.2},
    ],
    "start_pose": {"x": 0.1, "yaw": 0.1, "spread": [0.1, 0.1, 0.1]},
    "command": {
        "type": "waypoints",
        "through": [{"x": 1.5}, {"x": 2, "y": 0.5, "yaw": 1.57, "hold": 1}],
    },
    "gait_changes": [
        {"time": 1, "gait": "pace"},
        {"time": 2, "gait": {"name": "trot", "period": 0.4}, "robots": ["left"]},
    ],
    "pushes": [{"body": "left", "force": [0, 40, 0], "start": 1, "duration": 0.3}],
    "planner": {
        "horizon": 10, "dt": 0.03, "rate": 25.0, "qp": "structured", "hand_cone": {"grip": 250.0},
        "weights": {"foothold": [20, 20, 20]}, "penalties": {"ditch": {"stiffness": 5e4}},
    },
}  # fmt: skip
ROUGH = (
    {"type": "stairs", "steps": 6, "rise": 0.1, "tread": 0.3, "start": 0.7},
    {"type": "stones", "seed": 0, "start": 0.5, "length": 1.0},
    {"type": "walkway", "lanes": [0.73, 0.47, -0.47, -0.73], "lane_width": 0.14, "height": 0.05},
    {"type": "areas", "areas": [{"corners": [[-2, -2], [6, -2], [6, 2], [-2, 2]]}]},
    {"type": "plane", "z0": 0.0, "ax": 0.1, "ay": 0.0},
    {"type": "ramp", "H": 1.6, "kappa": 0.5, "xg": 2.0},
)
COMMANDS = b"""\
{"palanquin": "commands", "version": 1}
{"time": 0.5, "velocity": {"vx": 0.2, "vy": 0.0, "wz": 0.0}}
{"time": 1.2, "gait": {"gait": "pace", "robots": []}}
{"time": 3.0, "push": {"body": "left", "force": [0, 164, 0], "duration": 0.3}}
{"end": 12.5}
"""


def bytes_of(save):
    stream = io.BytesIO()
    save(stream)
    return stream.getvalue()


def require_named(path, error):
    """The message says which file it is about."""
    assert str(path) in str(error)


def look_at(path):
    """All that happens to a scenario before it is run."""
    file = ScenarioFile(path)
    scenario = file.scenario()
    for finding in findings(scenario):
        file.described(finding.path, finding.message)


@pytest.mark.parametrize("base", [EVERYTHING, *({"terrain": rough} for rough in ROUGH)])
def test_mutated_scenarios(tmp_path, base):
    text = SHIPPED["trot"].read_text()
    whole = {**YAML(typ="safe", pure=True).load(text), **base}
    outcomes = set()
    for seed in range(RUNS if base is EVERYTHING else RUNS // 5):
        part = mutated(whole if seed % 2 else whole["terrain"], seed)
        data = part if seed % 2 else {**whole, "terrain": part}
        path = tmp_path / "mine.json"
        path.write_text(json.dumps(data))
        try:
            look_at(path)
            outcomes.add("used")
        except ScenarioError as error:
            require_named(path, error)
            outcomes.add("refused")
    assert "refused" in outcomes


@pytest.mark.parametrize("name", ["stand", "trot", "ditch", "ramp"])
def test_mutated_cases(tmp_path, name):
    whole = json.loads((DATA / "cases" / f"{name}.json").read_text())
    path = tmp_path / "case.json"
    for seed in range(RUNS // 2):
        path.write_text(json.dumps(mutated(whole, seed)))
        try:
            problem = CaseProblem.of(parse_case(read_case(path), str(path)))
            problem.starts(4)
        except CaseError as error:
            require_named(path, error)


def test_mutated_layered_cases(tmp_path):
    whole = json.loads((DATA / "layered" / "holonomic_trot.json").read_text())
    path = tmp_path / "case.json"
    for seed in range(RUNS):
        path.write_text(json.dumps(mutated(whole, seed)))
        try:
            case = load_layered_case(path)
            case.team()
            case.par.settings()
            case.contacts()
        except CaseError as error:
            require_named(path, error)


HEIGHTS = np.linspace(0, 0.1, 42).reshape(6, 7)
MAPS = {
    ".npy": bytes_of(lambda f: np.save(f, HEIGHTS)),
    ".npz": bytes_of(lambda f: np.savez_compressed(f, heights=HEIGHTS)),
    ".csv": bytes_of(lambda f: np.savetxt(f, HEIGHTS, delimiter=",")),
    ".png": bytes_of(
        lambda f: matplotlib.image.imsave(f, HEIGHTS[..., None].repeat(3, 2), format="png")
    ),
}


def read_map(path):
    try:
        return HeightMapKind(type="height_map", file=str(path))
    except ValidationError as error:
        raise ProblemError(str(error)) from error


ROWS = b'{"key": "flat nominal 1", "conditions": {}, "row": {"seed": 1}}\n' * 2

READERS = [
    ("mine.yaml", SHIPPED["turn"].read_bytes(), load_scenario),
    ("mine.json", b'{"N": 15, "mu": 0.8, "s": [[[1, 1, 1, 1]], [[1, 0, 0, 1]]]}', read_case),
    ("mine.jsonl", COMMANDS, lambda path: replayed(load_scenario(SHIPPED["trot"]), path)),
    ("runs.jsonl", ROWS, lambda path: RowStore(path, {}, resume=True)),
    *((f"mine{suffix}", data, read_map) for suffix, data in MAPS.items()),
]


@pytest.mark.filterwarnings("ignore")  # of the parsers, about what is refused afterwards
@pytest.mark.parametrize(("name", "data", "read"), READERS, ids=[r[0] for r in READERS])
def test_garbled_files(tmp_path, name, data, read):
    read_well = tmp_path / name
    read_well.write_bytes(data)
    read(read_well)
    for seed in range(RUNS):
        path = tmp_path / name
        path.write_bytes(garbled(data, seed))
        try:
            read(path)
        except PalanquinError as error:
            require_named(path, error)


@pytest.mark.parametrize(
    ("name", "read", "error"),
    [
        ("mine.yaml", load_scenario, ScenarioError),
        ("mine.json", read_case, CaseError),
        ("mine.jsonl", lambda p: replayed(load_scenario(SHIPPED["trot"]), p), CommandFileError),
        ("mine.npy", read_heights, PalanquinError),
    ],
)
def test_what_is_no_file_of_that_kind(tmp_path, name, read, error):
    path = tmp_path / name
    for data in (b"", b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"[" * 100_000, b"1" * 5000):
        path.write_bytes(data)
        with pytest.raises(error, match=name):
            read(path)
    path.unlink()
    with pytest.raises(error, match=name):
        read(path)
    path.mkdir()
    with pytest.raises(error, match=name):
        read(path)


@pytest.mark.parametrize("read", [load_scenario, read_case])
def test_a_file_that_never_ends_is_refused(read, tmp_path):
    endless = tmp_path / "zero.yaml"
    endless.symlink_to("/dev/zero")
    with pytest.raises(PalanquinError, match="more than 64 MB"):
        read(endless)


def test_a_byte_order_mark_is_no_mistake(tmp_path):
    scenario, case = tmp_path / "trot.yaml", tmp_path / "case.json"
    scenario.write_bytes(b"\xef\xbb\xbf" + SHIPPED["trot"].read_bytes())
    assert load_scenario(scenario) == load_scenario(SHIPPED["trot"])
    case.write_bytes(b'\xef\xbb\xbf{"N": 1}')
    assert read_case(case) == {"N": 1}
