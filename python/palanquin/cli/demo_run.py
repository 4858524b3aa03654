"""A demo, whatever carries: looks at the scenario, runs it, writes its files, tells its figures."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import typer
from rich.table import Table

from palanquin.cli.console import NOT_SOLVED, out, show_progress_of_lowering
from palanquin.cli.demo_bars import BarsDemo
from palanquin.cli.demo_files import DemoFiles
from palanquin.cli.demo_hands import KinematicDemo, PhysicsDemo
from palanquin.cli.possible import require_possible
from palanquin.cli.watching import Bars, progress_bars, show
from palanquin.sim.feasibility import findings
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.scenarios import AnyScenario, BarScenario
from palanquin.sim.scenarios.physical import in_physics
from palanquin.sim.show.plots import draw_plots
from palanquin.sim.show.render import Motion


class Shown(Protocol):
    """What a demo does differently for each way of carrying."""

    def run(self, progress: Bars) -> Any:
        """Runs the scenario; returns its record."""

    def settings(self) -> dict[str, Any]:
        """What the run was made with, for its figures."""

    def more_figures(self) -> dict[str, Any]:
        """Beyond those of the outcome."""

    def record(self, path: Path) -> None:
        """Writes the Rerun recording."""

    def motion(self) -> Motion:
        """What is drawn."""

    def picture_share(self) -> float:
        """When its picture is taken, as a share of the duration."""

    def table(self, figures: dict[str, Any]) -> Table:
        """Its figures for a screen."""

    def explain_failure(self, figures: dict[str, Any]) -> None:
        """Says why it did not complete."""


@dataclass(frozen=True)
class Places:
    """Where a demo's files go: a folder, single files instead, and whether there is a video."""

    folder: Path
    rrd: Path | None
    json: Path | None
    has_video: bool


def walk(
    scenario: AnyScenario,
    places: Places,
    headless: bool | None,
    has_keys: bool = False,
) -> None:
    """Runs a demo, in physics unless told; raises InputError for what cannot be, typer.Exit when it
    did not complete.
    """
    scenario = in_physics(scenario)
    if not has_keys:
        require_possible(findings(scenario))
    files = DemoFiles.prepare(
        scenario.name, places.folder, places.rrd, places.json, places.has_video
    )
    out.print(scenario.described(), markup=False)
    show_progress_of_lowering()
    demo = _demo_of(scenario, has_keys)
    with progress_bars() as progress:
        record = demo.run(progress)
        figures = {
            "scenario": scenario.name, "tracking": scenario.tracking, "seed": scenario.seed,
            "robots": record.robots, "settings": demo.settings(), **outcome(record),
            **demo.more_figures(),
        }  # fmt: skip
        written = files.write(
            figures, partial(draw_plots, record), demo.record, demo.motion(),
            progress("video", 1.0), demo.picture_share(),
        )  # fmt: skip
    tell(demo, figures, written, headless)


def _demo_of(scenario: AnyScenario, has_keys: bool) -> Shown:
    if isinstance(scenario, BarScenario):
        return BarsDemo(scenario, has_keys)
    return PhysicsDemo(scenario) if scenario.tracking == "physics" else KinematicDemo(scenario)


def tell(
    demo: Shown, figures: dict[str, Any], written: dict[str, Path], headless: bool | None
) -> None:
    """Prints figures and files, opens the viewer, or says what went wrong."""
    out.print(demo.table(figures))
    for kind, path in written.items():
        out.print(f"{kind}: {path}", markup=False, highlight=False, soft_wrap=True)
    if not figures["completed"]:
        demo.explain_failure(figures)
        raise typer.Exit(NOT_SOLVED)
    show(written, headless)
