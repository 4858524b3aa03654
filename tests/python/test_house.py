"""The house's rules: who may use whom, how long things are, and the picture of it in the docs."""

import ast
import re
from functools import cache, partial
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
    "estimation": "control/{include/palanquin/control,src}/estimation",
    "plant": "sim/plant",
    "engine": "python/palanquin",
    "problems": "problems",
    "scenarios": "sim/{scenarios,errors.py,__init__.py}",
    "scenes": "sim/scenes",
    "runs": "sim/runs",
    "feasibility": "sim/feasibility",
    "show": "sim/show",
    "benchmarks": "benchmarks",
    "cli": "python/palanquin/cli",
}
CXX = ("core", "solvers", "planning", "whole_body", "estimation", "plant")

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
    found = [
        (len(folder), room)
        for room, pattern in ROOMS.items()
        for folder in folders(pattern)
        if f"{path}/".startswith(f"{folder}/")
    ]
    return max(found)[1] if found else None


@cache
def sources(*suffixes):
    """Files by their paths below the root, without tests."""
    tops = ("core", "solvers", "control", "sim", "python", "problems", "benchmarks")
    found = [p for top in tops for suffix in suffixes for p in (ROOT / top).rglob(f"*{suffix}")]
    return {p.relative_to(ROOT).as_posix(): p.read_text(encoding="utf-8") for p in found}


def path_of(module, known):
    """Where an imported module or package stands below the root, one of `known`; None for others'
    modules, and for what is no module.
    """
    head, *rest = module.split(".")
    base = [] if rest[:1] in (["sim"], ["problems"], ["benchmarks"]) else ["python", "palanquin"]
    path = "/".join([*base, *rest])
    found = [p for p in (f"{path}.py", f"{path}/__init__.py") if p in known]
    return found[0] if head == "palanquin" and found else None


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
            used = path_of(module, known)
            if used is not None:
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


HEAVY = [
    (r"#include [<\"]mujoco/", {"plant"}),
    (r"#include [<\"]pinocchio/", {"whole_body"}),
    (r"#include [<\"]coin-or/", {"solvers"}),
    (r"(?m)^\s*(?:import|from) mujoco\b", {"scenes", "show", "runs"}),
    (r"(?m)^\s*(?:import|from) rerun\b", {"show", "benchmarks"}),
]


@pytest.mark.parametrize(("words", "rooms"), HEAVY)
def test_a_heavy_dependency_has_one_place(words, rooms):
    users = {room_of(p): p for p, text in sources(".hpp", ".cpp", ".py").items()
             if re.search(words, text)}  # fmt: skip
    assert users.keys() <= rooms, users


# Who may use whom, from the bottom up, whatever the picture says.
ORDERS = (
    ("core", "solvers", "planning", "whole_body", "estimation", "plant"),
    ("problems", "scenarios", "scenes", "runs", "feasibility", "show", "benchmarks", "cli"),
)


def test_rooms_stand_on_those_below_them():
    for user, used in uses():
        for order in ORDERS:
            if {user, used} <= set(order):
                assert order.index(used) < order.index(user), f"{uses()[user, used]} uses {used}"


def code_of(text):
    """C++ without comments, which may say where an equation is from."""
    return re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.DOTALL)


LEGS = r"\bk?(?:num_?)?(?:legs|feet)\b\s*=\s*\d|\bk(?:Legs|Feet)\b|quadruped"
PAPERS = r"kim|vincenti|coros|\bclm|layered|holonomic|payload|carrier"


@pytest.mark.parametrize("words", [LEGS, PAPERS], ids=["number of legs", "paper"])
def test_engine_and_controller_name_no(words):
    for path, text in sources(".hpp", ".cpp").items():
        if room_of(path) in ("core", "solvers", "whole_body", "estimation"):
            found = re.search(words, code_of(text), re.IGNORECASE)
            assert not found, f"{path}: {found.group(0)}"


# What there is once in `problems`, `sim` and the package, and where.
ONCE = {
    "class Loop": "sim/runs/loop.py",
    "class Record": "sim/runs/record.py",
    "class Command": "problems/planning.py",
    "class Measurement": "problems/planning.py",
    "class Velocity": "problems/planning.py",
    "class Event": "python/palanquin/events.py",
    "class Pilot": "sim/scenarios/pilot.py",
    "class LiveView": "sim/show/live_view.py",
    "def outcome": "sim/runs/run_outcome.py",
    "def run_scenario": "sim/runs/scenarios.py",
    "def draw_plots": "sim/show/plots.py",
    "def write_recording": "sim/show/recording.py",
}


@pytest.mark.parametrize("what", ONCE)
def test_a_newcomer_finds_it_once(what):
    rooms = set(ROOMS) - {"benchmarks"}  # which has loops and records of solvers
    found = [
        path
        for path, text in sources(".py").items()
        if room_of(path) in rooms and re.search(rf"(?m)^{what}\b", text)
    ]
    assert found == [ONCE[what]]


def test_nobody_but_the_loop_moves_a_plant():
    users = [p for p, text in sources(".py").items() if re.search(r"\bplant\.advance\(", text)]
    assert users == ["sim/runs/loop.py"]
    users = [p for p, text in sources(".py").items() if "mj_step" in text]
    assert users == []


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


# A file that breaks a rule, and the test that says so.
BREACHES = {
    "core uses solvers": (
        "core/src/new.cpp", '#include "palanquin/solvers/sqp.hpp"\n',
        test_rooms_stand_on_those_below_them,
    ),
    "solvers use control": (
        "solvers/src/new.cpp", '#include "palanquin/control/planning/gait.hpp"\n',
        test_rooms_stand_on_those_below_them,
    ),
    "control uses the plant": (
        "control/src/whole_body/new.cpp", '#include "palanquin/plant/measurement.hpp"\n',
        test_rooms_stand_on_those_below_them,
    ),
    "problems use scenarios": (
        "problems/new.py", "from palanquin.sim.scenarios import Scenario\n",
        test_rooms_stand_on_those_below_them,
    ),
    "scenarios use the loop": (
        "sim/scenarios/new.py", "def f():\n    from palanquin.sim.runs import loop\n",
        test_rooms_stand_on_those_below_them,
    ),
    "the loop uses pictures": (
        "sim/runs/new.py", "import palanquin.sim.show.plots\n",
        test_rooms_stand_on_those_below_them,
    ),
    "a way round": (
        "core/src/new.cpp", '#include "palanquin/plant/measurement.hpp"\n',
        test_nobody_uses_a_room_above,
    ),
    "an arrow that is not drawn": (
        "sim/feasibility/new.py", "from palanquin.sim.show import plots\n",
        test_the_picture_has_the_arrows_that_there_are,
    ),
    "a number of legs": (
        "control/src/whole_body/new.cpp", "constexpr int kLegs = 4;\n",
        partial(test_engine_and_controller_name_no, LEGS),
    ),
    "a paper": (
        "solvers/src/new.cpp", "int layered_rows();\n",
        partial(test_engine_and_controller_name_no, PAPERS),
    ),
    "another user of MuJoCo": (
        "control/src/planning/new.cpp", "#include <mujoco/mujoco.h>\n",
        partial(test_a_heavy_dependency_has_one_place, *HEAVY[0]),
    ),
    "another record": (
        "sim/show/new.py", "class Record:\n    pass\n",
        partial(test_a_newcomer_finds_it_once, "class Record"),
    ),
    "another loop": (
        "benchmarks/new.py", "def f(plant):\n    plant.advance(0.1, None)\n",
        test_nobody_but_the_loop_moves_a_plant,
    ),
    "a long command": (
        "python/palanquin/cli/new.py", "def f():\n" + 40 * "    pass\n", test_a_command_is_short,
    ),
    "a long file": ("problems/new.py", 401 * "\n", test_a_file_has_one_concept),
}  # fmt: skip


@pytest.mark.parametrize("breach", BREACHES)
def test_a_breach_is_found(breach, monkeypatch):
    path, text, rule = BREACHES[breach]
    real = sources

    def with_breach(*suffixes):
        return {**real(*suffixes), **({path: text} if path.endswith(suffixes) else {})}

    monkeypatch.setattr(f"{__name__}.sources", with_breach)
    uses.cache_clear()
    try:
        with pytest.raises(AssertionError):
            rule()
    finally:
        uses.cache_clear()
