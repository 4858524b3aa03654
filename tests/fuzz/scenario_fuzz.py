"""Fuzzes the reader of scenarios and the check of what they ask for."""

import io
from pathlib import Path

from fuzz.harness import fuzz
from ruamel.yaml import YAML

from palanquin.sim.feasibility import findings
from palanquin.sim.scenarios import ScenarioFile


def read(path: Path) -> None:
    file = ScenarioFile(path)
    for finding in findings(file.scenario()):
        assert file.described(finding.path, finding.message)


def dump(data: object) -> bytes:
    text = io.BytesIO()
    YAML(typ="safe", pure=True).dump(data, text)
    return text.getvalue()


if __name__ == "__main__":
    watch = ("palanquin.sim.scenarios", "palanquin.sim.feasibility", "palanquin.schema")
    parse = YAML(typ="safe", pure=True).load
    fuzz(read, Path("sim/scenarios").glob("*.yaml"), ".yaml", parse, dump, watch)
