"""Fuzzes the reader of cases, the carrying team's and the layered ones."""

import json
from pathlib import Path

from fuzz.harness import fuzz

from palanquin.problems.case_files import read_case
from palanquin.problems.clm import parse_case
from palanquin.problems.layered.case import is_layered, parse_layered_case

DATA = Path("tests/data")


def read(path: Path) -> None:
    data = read_case(path)
    (parse_layered_case if is_layered(data) else parse_case)(data, str(path))


if __name__ == "__main__":
    names = ("stand", "trot", "ditch", "ramp")
    seeds = [
        *(DATA / "cases" / f"{name}.json" for name in names),
        DATA / "layered" / "holonomic_trot.json",
    ]
    watch = ("palanquin.problems.c", "palanquin.problems.layered.case", "palanquin.schema")
    fuzz(read, seeds, ".json", json.loads, lambda data: json.dumps(data).encode(), watch)
