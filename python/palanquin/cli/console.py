"""What the commands share: where they print, and how they report bad input."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import typer
from rich.console import Console

from palanquin.errors import LoweringError, PalanquinError

NOT_SOLVED = 1
BAD_INPUT = 2

out = Console()
err = Console(stderr=True, soft_wrap=True)


@contextmanager
def reported_errors() -> Iterator[None]:
    """Turns errors that a user can provoke into a message and exit status 2 (lowering: 1)."""
    try:
        yield
    except LoweringError as error:
        err.print(f"[red]error:[/red] {_escaped(error)}")
        raise typer.Exit(NOT_SOLVED) from error
    except (PalanquinError, ValueError, OSError) as error:
        err.print(f"[red]error:[/red] {_escaped(error)}")
        raise typer.Exit(BAD_INPUT) from error


def has_display() -> bool:
    """Whether a window can be opened."""
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def check_writable(option: str, file: Path | None) -> None:
    """Refuses an unusable output file before the work is done, not after it."""
    if file is None:
        return
    if file.is_dir():
        raise ValueError(f"{option} {file} is a folder; a file name is needed")
    if not file.absolute().parent.is_dir():
        raise ValueError(f"{option} {file}: there is no folder {file.absolute().parent}")


class _ConsoleHandler(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        err.print(record.getMessage(), style="dim", markup=False, highlight=False)


def show_progress_of_lowering() -> None:
    """Prints on stderr whether a problem was compiled or found in the cache."""
    logger = logging.getLogger("palanquin.lowering")
    if not logger.handlers:
        logger.addHandler(_ConsoleHandler())
        logger.setLevel(logging.INFO)


def _escaped(error: Exception) -> str:
    return str(error).replace("[", r"\[")
