"""Scenario files that the documentation shows are scenarios that can be."""

import re
from pathlib import Path

import pytest

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
