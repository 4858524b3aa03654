"""Progress bars while a demo runs, the viewer at its end, or what went wrong."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from palanquin.cli.console import err, has_display

if TYPE_CHECKING:  # imported late, so that --help is quick
    from palanquin.problems.clm.planner import Planner

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


def show_failed_plan(planner: Planner) -> None:
    """Explains the plan with which a run's last trouble began, if there was any."""
    if planner.failed_plan is not None:
        text = f"where planning failed last: {planner.failed_plan.explain()}"
        err.print(text, markup=False, highlight=False)


def show(written: dict[str, Path], headless: bool | None) -> None:
    """Opens Rerun's viewer on the recording, if there is one, in a process of its own.

    Not when `headless`, nor, when that is None, without a display.
    """
    if "recording" in written and not (not has_display() if headless is None else headless):
        command = [sys.executable, "-m", "rerun", str(written["recording"])]
        subprocess.Popen(command, start_new_session=True)
