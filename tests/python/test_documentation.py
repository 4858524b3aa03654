"""What the documentation shows is so: scenario files can be, outputs come from their programs."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from palanquin.cli import app
from palanquin.sim.feasibility import findings
from palanquin.sim.scenarios import load_scenario

ROOT = Path(__file__).parents[2]
SHOWN = [
    (document, text)
    for document in ("README.md", "docs/scenarios.md")
    for text in re.findall(r"```yaml\n(.*?)```", (ROOT / document).read_text(), re.DOTALL)
]


def test_there_are_examples():
    assert {document for document, _ in SHOWN} == {"README.md", "docs/scenarios.md"}


@pytest.mark.parametrize(("document", "text"), SHOWN)
def test_a_shown_scenario_is_possible(document, text, tmp_path):
    path = tmp_path / "shown.yaml"
    path.write_text(text)
    assert findings(load_scenario(path)) == []


ALIKE = re.compile(r"row \d+, knot \d+(?=\): 1e-09)")
"""Of rows that are met, rounding tells which is the worst."""

PROGRAMS = re.findall(
    r"```python\n# (\S+\.py)\n(.*?)```(?=\n).*?\n\n```\n(.*?)```",
    (ROOT / "docs" / "explained.md").read_text(),
    re.DOTALL,
)


@pytest.mark.parametrize(("name", "text", "shown"), PROGRAMS, ids=[p[0] for p in PROGRAMS])
def test_shown_outputs_are_real(name, text, shown, tmp_path, session_cache, monkeypatch):
    """But for times, which no two runs share."""
    monkeypatch.setenv("PALANQUIN_CACHE", str(session_cache))
    file = tmp_path / name
    file.write_text(text)
    if name == "car.py":
        output = CliRunner().invoke(app, ["check", f"{file}:car"]).stdout
    else:
        output = subprocess.run(
            [sys.executable, file], capture_output=True, text=True, check=True
        ).stdout

    def told(text):
        lines = text.strip().splitlines()
        lines = [line for line in lines if not line.startswith(("time: ", "lowering "))]
        return [ALIKE.sub("row, knot", line) for line in lines]

    assert told(output) == told(shown)


def test_there_are_programs():
    assert [name for name, *_ in PROGRAMS] == ["car.py", "cart.py"]
