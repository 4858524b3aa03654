"""What the commands share: where they print, and how they report bad input."""

from __future__ import annotations

import json
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import typer
from rich.console import Console

from palanquin.errors import LoweringError, PalanquinError

NOT_SOLVED = 1
BAD_INPUT = 2
STOPPED = 130  # as shells say of a Ctrl-C

out = Console()
err = Console(stderr=True, soft_wrap=True)


@contextmanager
def reported_errors() -> Iterator[None]:
    """Turns errors that a user can provoke into a message and exit status 2 (lowering: 1), and a
    Ctrl-C into 130.
    """
    try:
        yield
    except LoweringError as error:
        err.print(f"[red]error:[/red] {_escaped(error)}")
        raise typer.Exit(NOT_SOLVED) from error
    except (PalanquinError, ValueError, OSError) as error:
        err.print(f"[red]error:[/red] {_escaped(error)}")
        raise typer.Exit(BAD_INPUT) from error
    except KeyboardInterrupt as error:
        err.print("stopped")
        raise typer.Exit(STOPPED) from error


def has_display() -> bool:
    """Whether a window can be opened."""
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def check_writable(option: str, file: Path | None) -> None:
    """Refuses an unusable output file before the work is done, not after it."""
    if file is None:
        return
    with writing(option, file):
        if file.is_dir():
            raise ValueError(f"{option} {file} is a folder; a file name is needed")
        if not file.absolute().parent.is_dir():
            raise ValueError(f"{option} {file}: there is no folder {file.absolute().parent}")
        is_new = not file.exists()
        if is_new or file.is_file():
            file.open("ab").close()
        if is_new:
            file.unlink()


def prepare_folder(option: str, folder: Path) -> None:
    """Makes a folder for results; refuses an unusable place before the work is done."""
    with writing(option, folder):
        if folder.exists() and not folder.is_dir():
            raise ValueError(f"{option} {folder} is a file; a folder is needed")
        folder.mkdir(parents=True, exist_ok=True)
        TemporaryFile(dir=folder).close()


@contextmanager
def writing(option: str, path: Path) -> Iterator[None]:
    """Names the option and its path in errors of what writes there: no permission, a full disk."""
    try:
        yield
    except PalanquinError:
        raise
    except (OSError, RuntimeError) as error:  # RuntimeError: Rerun's
        reason = getattr(error, "strerror", None) or error
        raise ValueError(f"{option} {path}: {reason}") from error


def write_json(option: str, file: Path | None, figures: Any, indent: int | None = None) -> None:
    """Writes figures to a file, if there is one; raises ValueError that names option and file."""
    if file is not None:
        with writing(option, file):
            text = json.dumps(figures, allow_nan=False, indent=indent)
            file.write_text(text + "\n", encoding="utf-8")


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
