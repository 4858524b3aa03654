"""Options that measurements and reproductions of figures share."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer

from palanquin.errors import ProblemError

Folder = Annotated[Path, typer.Option("--out", metavar="FOLDER", help="For everything.")]
Resume = Annotated[bool, typer.Option("--resume", help="Keep rows that --out already holds.")]
JsonFile = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="For all results.")]
Headless = Annotated[
    bool, typer.Option("--headless", help="Open no window; benchmarks and figures never do.")
]


def parts(text: str, separator: str = ",") -> list[str]:
    """What stands between separators, without spaces and empty parts."""
    return [part.strip() for part in text.split(separator) if part.strip()]


def chosen(option: str, text: str, known: Iterable[str]) -> list[str]:
    """The names in `text`, all of `known` if there are none; ProblemError for an unknown one."""
    names, there_are = parts(text), list(dict.fromkeys(known))
    for name in names:
        if name not in there_are:
            raise ProblemError(f"{option} {name!r} is unknown; there are {', '.join(there_are)}")
    return names or there_are
