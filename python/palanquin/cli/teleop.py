"""`palanquin teleop`: a team that walks live as somebody at the keyboard tells it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

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
from palanquin.cli.demo_options import HowTracked
from palanquin.cli.in_step import InStep
from palanquin.cli.watching import show_failed_plan
from palanquin.schema import LAST_SEED

if TYPE_CHECKING:  # imported late, so that --help is quick
    from palanquin.sim.runs.loop import Tick
    from palanquin.sim.scenarios import AnyScenario
    from palanquin.sim.scenarios.pilot import Pilot
    from palanquin.sim.scenarios.script import Director

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
    headless: Headless = None, seed: Seed = None, tracking: HowTracked = None,
) -> None:  # fmt: skip
    """Drives a team with the keyboard, in real time, and shows its plan live in Rerun.

    Arrows change speed and turn, a and d go sideways, space stops, 1 to 6 choose the gait, tab
    chooses a body, p and o push it, q quits; robots on bars are driven all at once or one by one,
    and not pushed. They walk in full physics unless told to walk kinematically. What the scenario
    itself commands is left aside. `palanquin demo NAME --commands FILE` makes a video of a recorded
    session.

    Exit status: 0 done, 1 the plan diverged or a robot fell, 2 bad input.
    """
    with reported_errors(), ExitStack() as stack:
        from palanquin.cli.demo_overrides import overridden
        from palanquin.cli.keyboard import open_keyboard
        from palanquin.cli.possible import require_possible
        from palanquin.sim.feasibility import findings
        from palanquin.sim.scenarios import open_any
        from palanquin.sim.scenarios.physical import in_physics
        from palanquin.sim.scenarios.pilot import Pilot

        told = overridden(open_any(name), commands=commands, seed=seed, tracking=tracking)
        scenario = in_physics(told)
        check_writable("--rrd", rrd)
        check_writable("--record", record)
        require_possible(findings(scenario) if commands or scenario.carry == "hands" else ())
        show_progress_of_lowering()
        pilot = None if commands else Pilot.of(scenario)
        view = stack.enter_context(_live_view(scenario, rrd, headless))
        director = stack.enter_context(_directing(scenario, pilot, record))
        keyboard = stack.enter_context(open_keyboard()) if pilot else None
        session = Session(scenario, pilot, InStep(director, keyboard, _press(pilot)), view)
        fall = session.run()
    out.print(session.summary(), markup=False)
    if fall:
        err.print(fall, markup=False)
        session.explain()
        raise typer.Exit(NOT_SOLVED)


def _press(pilot: Pilot | None) -> Callable[[str], None]:
    return (lambda key: None) if pilot is None else pilot.press


@contextmanager
def _directing(
    scenario: AnyScenario, pilot: Pilot | None, record: Path | None
) -> Iterator[Director]:
    """The pilot, or the scenario's own commands; what it orders is written to a file, if asked."""
    from palanquin.sim.scenarios import BarScenario
    from palanquin.sim.scenarios.recorded import CommandRecorder

    director: Director = scenario if isinstance(scenario, BarScenario) else scenario.script()
    director = pilot or director
    if record is None:
        yield director
        return
    robots = scenario.names if isinstance(scenario, BarScenario) else ()
    with CommandRecorder(director, record, robots) as recorder:
        yield recorder


class Session:
    """Runs ticks in real time between a keyboard and a view."""

    def __init__(
        self, scenario: AnyScenario, pilot: Pilot | None, in_step: InStep, view: Any
    ) -> None:
        from palanquin.sim.runs.scenarios import loop_of

        self._name, self._pilot, self._in_step, self._view = scenario.name, pilot, in_step, view
        self._planner = scenario.build_planner()
        self._loop = loop_of(scenario, self._planner, in_step)
        self._ticks = self._fallbacks = 0
        self._worst_ms = 0.0

    def run(self) -> str:
        """Until the pilot quits or the commands end; returns why it ended before, in words."""
        most = None if self._pilot else self._loop.most
        with Live(console=out, auto_refresh=False, transient=True) as screen:
            shown = 0.0
            for tick in islice(self._loop.ticks(), most):
                self._count(tick)
                if self._view is not None:
                    self._view.show(tick)
                if time.perf_counter() - shown > _STATUS_INTERVAL:
                    screen.update(self._screen(tick), refresh=True)
                    shown = time.perf_counter()
        return self._loop.plant.fall

    def summary(self) -> str:
        """What the session was like, in a sentence."""
        return (
            f"{self._loop.period * self._ticks:.1f} s, {self._ticks} plans, the slowest "
            f"{self._worst_ms:.1f} ms, {self._in_step.late} ticks late, "
            f"{self._fallbacks} fallbacks"
        )

    def explain(self) -> None:
        """Says where planning failed last, if the planner can tell."""
        from palanquin.problems import clm

        if isinstance(self._planner, clm.Planner):
            show_failed_plan(self._planner)

    def _count(self, tick: Tick) -> None:
        self._ticks += 1
        self._worst_ms = max(self._worst_ms, tick.plan.solve_ms)
        self._fallbacks += not tick.plan.is_usable

    def _screen(self, tick: Tick) -> Table:
        told = tick.orders.velocity
        table = Table(show_header=False, title=self._name)
        table.add_row("time", f"{tick.time:.1f} s")
        table.add_row(
            "command",
            f"vx {told.vx:.2f} m/s, vy {told.vy:.2f} m/s, wz {told.wz:.2f} rad/s",
        )
        late = f"{self._in_step.late} ticks late so far"
        table.add_row("plan", f"{tick.plan.solve_ms:.1f} ms, {late}")
        if self._pilot is not None:
            table.add_row("gait, keys act on", f"{self._pilot.gait}, {self._pilot.target}")
            table.add_row("keys", "; ".join(f"{keys}: {what}" for keys, what in self._pilot.keys))
            table.add_row("", self._pilot.note)
        return table


@contextmanager
def _live_view(scenario: AnyScenario, rrd: Path | None, headless: bool | None) -> Iterator[Any]:
    """The view, or None when nothing is to be shown or Rerun is not installed."""
    spawn = has_display() if headless is None else not headless
    if not spawn and rrd is None:
        err.print("no display: `--rrd FILE` records what a window would show", style="yellow")
        yield None
        return
    try:
        from palanquin.sim.show.live_view import LiveView
    except ModuleNotFoundError as error:
        if error.name != "rerun":
            raise
        err.print("nothing is shown: `pip install palanquin[viz]` adds Rerun", style="yellow")
        yield None
        return
    from palanquin.sim.show.live_stage import stage_of

    view = LiveView(stage_of(scenario), rrd, spawn)
    try:
        yield view
    finally:
        view.close()
