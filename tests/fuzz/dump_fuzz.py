"""Fuzzes the reader of dumped solves: the archive's bytes, and the values in its header."""

import io
import json
import zipfile
from typing import Any

from fuzz.harness import SCRATCH, fuzz
from support.small_problems import LIBRARY

import palanquin as pq
from palanquin.dump import read_dump

HEADER = "dump.json"
seed = SCRATCH / "seed.palanquin"


def parse(data: bytes) -> Any:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return json.loads(archive.read(HEADER))


def dump(header: Any) -> bytes:
    """The seed with another header."""
    changed = io.BytesIO()
    with zipfile.ZipFile(seed) as archive, zipfile.ZipFile(changed, "w") as other:
        for name in archive.namelist():
            data = json.dumps(header).encode() if name == HEADER else archive.read(name)
            if not name.endswith(".so"):  # nothing of it is run
                other.writestr(name, data)
    return changed.getvalue()


if __name__ == "__main__":
    SCRATCH.mkdir(parents=True, exist_ok=True)
    lowered = LIBRARY["Hopper"].build().lower()
    pq.Sqp(lowered).dump(seed, lowered.parameters(), lowered.knot())
    seed.write_bytes(dump(parse(seed.read_bytes())))
    fuzz(read_dump, [seed], ".palanquin", parse, dump, ("palanquin.dump", "palanquin.schema"))
