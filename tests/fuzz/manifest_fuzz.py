"""Fuzzes the reader of saved problems' manifests, lines of words that C++ reads."""

from pathlib import Path

from fuzz.harness import SCRATCH, fuzz
from support.small_problems import LIBRARY

from palanquin.code import MANIFEST, SavedCode

folder = SCRATCH / "saved"


def read(path: Path) -> None:
    (folder / MANIFEST).write_bytes(path.read_bytes())
    SavedCode.read(folder)


def parse(data: bytes) -> list[list[str]]:
    return [line.split() for line in data.decode().splitlines()]


def dump(lines: list[list[object]]) -> bytes:
    return "\n".join(" ".join(map(str, words)) for words in lines).encode()


if __name__ == "__main__":
    SCRATCH.mkdir(parents=True, exist_ok=True)
    LIBRARY["Hopper"].build().lower().save(folder)
    seed = SCRATCH / "manifest-seed"
    seed.write_bytes((folder / MANIFEST).read_bytes())
    fuzz(read, [seed], "", parse, dump, ("palanquin.code",))
