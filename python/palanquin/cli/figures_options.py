"""Options that all reproductions of figures share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Folder = Annotated[Path, typer.Option("--out", metavar="FOLDER", help="For everything.")]
JsonFile = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="For all results.")]
Headless = Annotated[bool, typer.Option("--headless", help="Open no window; figures never do.")]
