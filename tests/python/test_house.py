"""The house's rules: who may use whom, how long things are, and the picture of it in the docs."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ARCHITECTURE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")

# Rooms from the bottom up; a file belongs to the room with the longest folder that it is below.
ROOMS = {
    "core": "core",
    "solvers": "solvers",
    "planning": "control/{include/palanquin/control,src}/planning",
    "whole_body": "control/{include/palanquin/control,src}/whole_body",
    "plant": "sim/plant",
    "engine": "python/palanquin",
    "problems": "problems",
    "scenarios": "sim/scenarios",
    "scenes": "sim",
    "runs": "sim/runs",
    "feasibility": "sim/feasibility",
    "benchmarks": "benchmarks",
    "cli": "python/palanquin/cli",
}
CXX = ("core", "solvers", "planning", "whole_body", "plant")
# A file that shows a run is part of the scenes' folder, but stands above the loop.
ABOVE_RUNS = re.compile(
    r"sim/(bar_plots|clearance|figures|kinematic|live_\w+|overlay|recording|render|rerun_\w+|swing)\.py"
)
# What scenes are made of as data, and who directs a run, stand beside the scenes.
DATA = re.compile(r"sim/(driver|errors|ground|pilot|team)\.py")

LONGEST_FILE = 400
LONGEST_COMMAND = 40


def folders(pattern):
    """With each of the alternatives in braces."""
    match = re.search(r"\{(.*?)\}", pattern)
    if match is None:
        return [pattern]
    return [pattern.replace(match.group(0), choice) for choice in match.group(1).split(",")]


def room_of(path):
    """The room of a file, by its path below the root."""
    if ABOVE_RUNS.fullmatch(path):
        return "show"
    if DATA.fullmatch(path):
        return "scenarios"
    found = [
        (len(folder), room)
        for room, pattern in ROOMS.items()
        for folder in folders(pattern)
        if path.startswith(f"{folder}/")
    ]
    return max(found)[1] if found else None


@cache
def sources(*suffixes):
    """Files by their paths below the root, without tests."""
    tops = ("core", "solvers", "control", "sim", "python", "problems", "benchmarks")
    found = [p for top in tops for suffix in suffixes for p in (ROOT / top).rglob(f"*{suffix}")]
    return {p.relative_to(ROOT).as_posix(): p.read_text(encoding="utf-8") for p in found}


def path_of(module):
    """Where an imported module stands below the root; None for other packages' modules."""
    head, *rest = module.split(".")
    if head != "palanquin":
        return None
    for base in ("sim", "problems", "benchmarks"):
        if rest[:1] == [base]:
            return "/".join(rest) + ("" if len(rest) > 1 else "/__init__") + ".py"
    return "/".join(["python", "palanquin", *(rest or ["__init__"])]) + ".py"


def imported(text):
    """Modules that a Python file imports anywhere in it."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


@cache
def uses():
    """Who uses whom, as pairs of rooms with a file that does: {(user, used): path}."""
    found = {}
    known = sources(".py")
    for path, text in known.items():
        for module in imported(text):
            used = path_of(module)
            # Who imports a module out of `sim` itself is counted by the module.
            if used in (None, "sim/__init__.py") or not (
                used in known or used[:-3] + "/__init__.py" in known
            ):
                continue
            found.setdefault((room_of(path), room_of(used)), path)
    for path, text in sources(".hpp", ".cpp").items():
        for room, pattern in re.findall(
            r'#include [<"]palanquin/(core|solvers|plant|control)/(\w+)', text
        ):
            used = pattern if room == "control" else room
            found.setdefault((room_of(path), used), path)
    return {pair: path for pair, path in found.items() if pair[0] != pair[1] and pair[0]}


def drawn():
    """Arrows of the picture in the docs: {(user, used)}."""
    (picture,) = re.findall(r"```mermaid\n(.*?)```", ARCHITECTURE, re.DOTALL)
    arrows = set()
    for line in picture.splitlines():
        if "-->" in line:
            user, used = line.split("-->")
            arrows |= {(user.strip(), one.strip()) for one in used.split("&")}
    return arrows


def test_the_picture_has_the_arrows_that_there_are():
    there = {pair: path for pair, path in uses().items() if "engine" not in pair}
    missing = {pair: path for pair, path in there.items() if pair not in drawn()}
    assert not missing, "used, but not drawn in docs/architecture.md"
    assert not drawn() - there.keys(), "drawn in docs/architecture.md, but not used"


def test_nobody_uses_a_room_above():
    """The picture has no way round: rooms can be put one above the other."""
    left, arrows = {room for pair in uses() for room in pair}, set(uses())
    arrows -= {("cli", "engine"), ("engine", "cli")}  # `python -m palanquin` starts the commands
    while left:
        ground = {room for room in left if not any(user == room for user, _ in arrows)}
        assert ground, f"a circle among {sorted(left)}: {sorted(arrows)}"
        left -= ground
        arrows = {pair for pair in arrows if pair[1] not in ground}


@pytest.mark.parametrize(
    ("words", "rooms"),
    [
        (r"#include [<\"]mujoco/", {"plant"}),
        (r"#include [<\"]pinocchio/", {"whole_body"}),
        (r"#include [<\"]coin-or/", {"solvers"}),
        (r"(?m)^\s*(?:import|from) mujoco\b", {"scenes", "show", "runs"}),
        (r"(?m)^\s*(?:import|from) rerun\b", {"show", "benchmarks"}),
    ],
)
def test_a_heavy_dependency_has_one_place(words, rooms):
    users = {room_of(p): p for p, text in sources(".hpp", ".cpp", ".py").items()
             if re.search(words, text)}  # fmt: skip
    assert users.keys() <= rooms, users


def test_engine_and_controller_name_no_number_of_legs():
    for path, text in sources(".hpp", ".cpp").items():
        if room_of(path) in ("core", "solvers", "whole_body"):
            assert not re.search(r"\bk?(?:num_?)?legs\b\s*=\s*4", text, re.IGNORECASE), path


# Files that were longer when this rule came; they may shrink.
LONG_FILES = {
    "solvers/src/sqp.cpp": 650,
    "solvers/src/nlp.cpp": 500,
    "python/palanquin/plan.py": 550,
}


def test_a_file_has_one_concept():
    for path, text in sources(".hpp", ".cpp", ".py").items():
        lines = text.count("\n")
        assert lines <= LONG_FILES.get(path, LONGEST_FILE), f"{path}: {lines} lines"


def functions():
    """Of the command line: path, name and length."""
    for path, text in sources(".py").items():
        if room_of(path) != "cli":
            continue
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef):
                yield path, node.name, node.end_lineno - node.lineno + 1


def test_a_command_is_short():
    for path, name, length in functions():
        assert length <= LONGEST_COMMAND, f"{path}: {name} has {length}"


STEPS = re.findall(r"(?m)^\d+\. (?:[^\n]|\n(?!\d))*?`(\w+)` in\s+`([^`]+)`", ARCHITECTURE)


def test_the_way_of_a_measured_state_is_there():
    assert len(STEPS) >= 8
    for name, path in STEPS:
        assert re.search(rf"\b{re.escape(name)}\b", (ROOT / path).read_text()), (name, path)


def test_the_way_passes_each_room_once():
    rooms = [room_of(path) for _, path in STEPS]
    visits = [room for i, room in enumerate(rooms) if i == 0 or rooms[i - 1] != room]
    assert len(visits) == len(set(visits)), visits
