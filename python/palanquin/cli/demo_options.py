"""Options that all demos share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Headless = Annotated[
    bool | None,
    typer.Option(
        "--headless/--window",
        help="Without or with Rerun's viewer at the end; a window if there is a display.",
    ),
]
OutFolder = Annotated[Path, typer.Option("--out", help="Folder for all files.")]
JsonFile = Annotated[Path | None, typer.Option("--json", help="File for the figures instead.")]
Rrd = Annotated[Path | None, typer.Option("--rrd", help="File for the Rerun recording instead.")]
Video = Annotated[bool, typer.Option(help="Draw the video.")]
