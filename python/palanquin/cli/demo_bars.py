"""The demo of robots on bars: full physics, perhaps driven by keys."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from typing import Any

from rich.table import Table

from palanquin.cli.console import err
from palanquin.cli.demo_files import PICTURE_SHARE
from palanquin.cli.keyboard import Keyboard, open_keyboard
from palanquin.cli.watching import Bars
from palanquin.sim.bar.scene import build_bar_scene
from palanquin.sim.bar_plots import draw_plots
from palanquin.sim.driver import HELP, Driver
from palanquin.sim.recording import write_recording
from palanquin.sim.render import Motion
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.scenarios import run_bars, ticks_of
from palanquin.sim.scenarios import BarScenario
from palanquin.sim.scenarios.bar_planners import build_planner
from palanquin.sim.scenarios.script import Director, Orders


class BarsDemo:
    """As of `Shown`; `has_keys`: somebody at the keyboard commands."""

    def __init__(self, scenario: BarScenario, has_keys: bool) -> None:
        self._scenario, self._has_keys = scenario, has_keys

    def run(self, progress: Bars) -> Record:
        """To the end or a fall."""
        scenario = self._scenario
        with _driving(scenario, self._has_keys) as director:
            planner = build_planner(scenario)
            advance = progress("walking", ticks_of(scenario, planner.settings.dt))
            self._record = run_bars(scenario, planner, director, advance)
        self._scene = build_bar_scene(scenario.team, scenario.ground)
        return self._record

    def settings(self) -> dict[str, Any]:
        """The scenario's fields."""
        return self._scenario.as_data()

    def more_figures(self) -> dict[str, Any]:
        """None."""
        return {}

    def plot(self, path: Path) -> None:
        """Velocities, forces, virtual constraints, multipliers, times."""
        draw_plots(self._record, path)

    def record(self, path: Path) -> None:
        """Bodies, forces, plan and control."""
        write_recording(self._record, self._scene, path)

    def motion(self) -> Motion:
        """As simulated."""
        return Motion(self._scene.model, self._record.time, self._record.more["qpos"])

    def picture_share(self) -> float:
        """Under way."""
        return PICTURE_SHARE

    def table(self, figures: dict[str, Any]) -> Table:
        """Errors, torques, times."""
        table = Table(title=f"{self._scenario.name}: {self._scenario.planner}", show_header=False)
        table.add_row("completed", "yes" if figures["completed"] else "no")
        table.add_row(
            "duration, distance", f"{figures['duration_s']:.1f} s, {figures['distance_m']:.2f} m"
        )
        if error := figures["velocity_error_m_s"]:
            table.add_row(
                "velocity error after 2 s",
                f"rms {error['rms']:.3f} m/s, over strides {error['stride_rms']:.3f} m/s",
            )
        table.add_row("bar's length error", f"{1e3 * figures['bar_length_error_m']:.3g} mm")
        share = f"{100 * figures['torque_fraction_max']:.0f} % of its limit"
        table.add_row("largest torque", share)
        times = ", ".join(f"{name} {value:.2f}" for name, value in figures["solve_ms"].items())
        table.add_row("time of a plan, ms", times)
        table.add_row("a robot's controller, mean", f"{1e3 * figures['control_ms_mean']:.0f} us")
        kept = f"{figures['fallbacks']}, {figures['control_fallbacks']}"
        table.add_row("fallbacks of planner, controllers", kept)
        table.add_row("faster than real time", f"{figures['real_time_factor']:.2f} times")
        return table

    def explain_failure(self, figures: dict[str, Any]) -> None:
        """What fell, and the last plans that were none."""
        record = self._record
        err.print(f"fell after {record.duration:.2f} s: {record.fall}", markup=False)
        if record.events:
            err.print(f"{len(record.events)} samples had no plan of their own; the last:")
        for event in record.events[-3:]:
            err.print(f"  {event.time:.3f} s: {event.reason}", markup=False, highlight=False)


@contextmanager
def _driving(scenario: BarScenario, has_keys: bool) -> Iterator[Director | None]:
    """Commands from the keyboard in step with the wall's clock, if they are asked for."""
    if not has_keys:
        yield None
        return
    driver, names = Driver(scenario.team.robots), scenario.team.names
    err.print(HELP, markup=False)
    with open_keyboard() as keyboard:
        yield _Keys(driver, keyboard, names)


class _Keys:
    """Directs in step with the wall's clock: keys are pressed until it is time."""

    def __init__(self, driver: Driver, keyboard: Keyboard, names: Sequence[str]) -> None:
        self._driver, self._keyboard, self._names = driver, keyboard, names
        self._start = perf_counter()

    def at(self, time: float, pose: Any, period: float) -> Orders | None:
        """As of `Director`."""
        for key in self._keyboard.until(self._start + time):
            self._driver.press(key)
            err.print(self._driver.describe(self._names), markup=False)
        return self._driver.at(time, pose, period)
