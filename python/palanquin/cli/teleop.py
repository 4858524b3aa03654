"""`palanquin teleop`: a team that walks live as somebody at the keyboard tells it."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.live import Live
from rich.table import Table

from palanquin.cli.console import (
    NOT_SOLVED,
    check_writable,
    err,
    has_display,
    out,
    reported_errors,
    show_progress_of_lowering,
)
from palanquin.cli.watching import show_failed_plan
from palanquin.schema import LAST_SEED

if TYPE_CHECKING:  # imported late, so that --help is quick
    from palanquin.cli.keyboard import Keyboard
    from palanquin.sim.pilot import Pilot
    from palanquin.sim.runs.loop import Tick
    from palanquin.sim.scenarios import Scenario

_STATUS_INTERVAL = 0.1
"""Between two looks at the status line, s."""


Team = Annotated[str, typer.Argument(metavar="[NAME|FILE]", help="The scenario whose team walks.")]
RecordFile = Annotated[
    Path | None, typer.Option("--record", help="File for the commands, to replay them.")
]
Commands = Annotated[Path | None, typer.Option(help="Recorded commands instead of the keyboard.")]
Rrd = Annotated[Path | None, typer.Option("--rrd", help="File for the Rerun recording.")]
Headless = Annotated[
    bool | None,
    typer.Option(
        "--headless/--window",
        help="Without or with Rerun's viewer; a window if there is a display.",
    ),
]
Seed = Annotated[int | None, typer.Option(min=0, max=LAST_SEED, help="As of `palanquin demo`.")]


def teleop(
    name: Team = "trot", record: RecordFile = None, commands: Commands = None, rrd: Rrd = None,
    headless: Headless = None, seed: Seed = None,
) -> None:  # fmt: skip
    """Drives a team with the keyboard, in real time, and shows its plan live in Rerun.

    Arrows change speed and turn, a and d go sideways, space stops, 1 to 6 choose the gait, tab
    chooses a body, p and o push it, q quits. What the scenario itself commands is left aside.
    `palanquin demo NAME --commands FILE` makes a video of a recorded session.

    Exit status: 0 done, 1 the plan diverged, 2 bad input.
    """
    with reported_errors(), ExitStack() as stack:
        from palanquin.cli.demo_overrides import hands_overridden
        from palanquin.cli.keyboard import open_keyboard
        from palanquin.cli.possible import require_possible
        from palanquin.sim.feasibility import findings
        from palanquin.sim.pilot import Pilot
        from palanquin.sim.scenarios import open_scenario
        from palanquin.sim.scenarios.recorded import CommandRecorder

        scenario = hands_overridden(open_scenario(name), commands=commands, seed=seed)
        check_writable("--rrd", rrd)
        check_writable("--record", record)
        require_possible(findings(scenario))
        show_progress_of_lowering()
        planner = scenario.build_planner()
        pilot = None if commands else Pilot(scenario.bodies, scenario.robots[0].gait.name)
        director: Any = pilot or scenario.script()
        view = stack.enter_context(_live_view(scenario, rrd, headless))
        if record is not None:
            director = stack.enter_context(CommandRecorder(director, record))
        keyboard = stack.enter_context(open_keyboard()) if pilot else None
        session = Session(scenario, pilot, keyboard, view)
        completed = session.run(planner, director)
    out.print(session.summary(), markup=False)
    if not completed:
        err.print("the plan diverged", markup=False)
        show_failed_plan(planner)
        raise typer.Exit(NOT_SOLVED)


class Session:
    """Runs ticks in real time between a keyboard and a view."""

    def __init__(
        self, scenario: Scenario, pilot: Pilot | None, keyboard: Keyboard | None, view: Any
    ) -> None:
        self._scenario, self._pilot = scenario, pilot
        self._keyboard, self._view = keyboard, view
        self._ticks = self._late = self._fallbacks = 0
        self._worst_ms = 0.0

    def run(self, planner: Any, director: Any) -> bool:
        """Until the pilot quits or the commands end; returns whether the plan lasted so long."""
        from palanquin.sim.runs.loop import ticks
        from palanquin.sim.runs.scenarios import nominal

        period = self._scenario.planner.period
        plant, leading = nominal(planner, period, self._scenario.start(planner))
        with Live(console=out, auto_refresh=False, transient=True) as screen:
            shown, deadline = 0.0, time.perf_counter()
            for tick in ticks(plant, leading, director, period):
                if self._ticks == 0:
                    deadline = time.perf_counter()
                self._count(tick)
                if self._view is not None:
                    self._view.show(tick)
                if time.perf_counter() - shown > _STATUS_INTERVAL:
                    screen.update(self._screen(tick), refresh=True)
                    shown = time.perf_counter()
                deadline += period
                self._late += time.perf_counter() > deadline
                # What is late is not caught up with: the team would rush.
                deadline = max(deadline, time.perf_counter())
                self._wait(deadline)
                if self._is_over(tick.time + period):
                    return True
        return False

    def summary(self) -> str:
        """What the session was like, in a sentence."""
        seconds = self._ticks * self._scenario.planner.period
        return (
            f"{seconds:.1f} s, {self._ticks} plans, the slowest {self._worst_ms:.1f} ms, "
            f"{self._late} ticks late, {self._fallbacks} fallbacks"
        )

    def _count(self, tick: Tick) -> None:
        self._ticks += 1
        self._worst_ms = max(self._worst_ms, tick.plan.solve_ms)
        self._fallbacks += not tick.plan.plan.is_usable

    def _wait(self, deadline: float) -> None:
        """Until the next tick is due; keys are taken meanwhile."""
        if self._keyboard is None or self._pilot is None:
            time.sleep(max(deadline - time.perf_counter(), 0.0))
            return
        for key in self._keyboard.until(deadline):
            self._pilot.press(key)

    def _is_over(self, now: float) -> bool:
        if self._pilot is not None:
            return self._pilot.has_quit
        return now > self._scenario.duration - self._scenario.planner.period / 2

    def _screen(self, tick: Tick) -> Table:
        told = tick.orders.velocity
        table = Table(show_header=False, title=self._scenario.name)
        table.add_row("time", f"{tick.time:.1f} s")
        table.add_row(
            "command",
            f"vx {told.vx:.2f} m/s, vy {told.vy:.2f} m/s, wz {told.wz:.2f} rad/s",
        )
        table.add_row("plan", f"{tick.plan.solve_ms:.1f} ms, {self._late} ticks late so far")
        if self._pilot is not None:
            from palanquin.sim.pilot import KEYS

            table.add_row("gait, push", f"{self._pilot.gait}, {self._pilot.target}")
            table.add_row("keys", "; ".join(f"{keys}: {what}" for keys, what in KEYS))
            table.add_row("", self._pilot.note)
        return table


@contextmanager
def _live_view(scenario: Scenario, rrd: Path | None, headless: bool | None) -> Iterator[Any]:
    """The view, or None when nothing is to be shown or Rerun is not installed."""
    spawn = has_display() if headless is None else not headless
    if not spawn and rrd is None:
        err.print("no display: `--rrd FILE` records what a window would show", style="yellow")
        yield None
        return
    try:
        from palanquin.sim.live_view import LiveView
    except ModuleNotFoundError as error:
        if error.name != "rerun":
            raise
        err.print("nothing is shown: `pip install palanquin[viz]` adds Rerun", style="yellow")
        yield None
        return
    start = np.array([0.0, 0.0, scenario.ground.height(0.0, 0.0) + scenario.payload.height])
    view = LiveView(scenario.scene, scenario.planner.dt, start, rrd, spawn)
    try:
        yield view
    finally:
        view.close()
