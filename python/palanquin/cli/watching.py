"""Progress bars while a demo runs, and the viewer at its end."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from palanquin.cli.console import err, has_display

Bars = Callable[[str, float], Callable[[float], None]]
"""Makes a progress bar from what is done and its total; the result takes how much is done."""


@contextmanager
def progress_bars() -> Iterator[Bars]:
    """Bars that vanish at the end."""
    columns = TextColumn("{task.description:<9}"), BarColumn(), TaskProgressColumn()
    with Progress(*columns, TimeRemainingColumn(), console=err, transient=True) as progress:

        def bar(what: str, total: float) -> Callable[[float], None]:
            task = progress.add_task(what, total=total, visible=False)

            def advance(done: float) -> None:
                progress.update(task, completed=done, visible=True)

            return advance

        yield bar


def show(written: dict[str, Path], headless: bool | None) -> None:
    """Opens Rerun's viewer on the recording, if there is one, in a process of its own.

    Not when `headless`, nor, when that is None, without a display.
    """
    if "recording" in written and not (not has_display() if headless is None else headless):
        command = [sys.executable, "-m", "rerun", str(written["recording"])]
        subprocess.Popen(command, start_new_session=True)
