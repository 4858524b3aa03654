"""The demo of robots on bars, perhaps driven by keys."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.table import Table

from palanquin.cli.console import err
from palanquin.cli.demo_files import PICTURE_SHARE
from palanquin.cli.in_step import InStep
from palanquin.cli.keyboard import open_keyboard
from palanquin.cli.watching import Bars
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.scenarios import loop_of
from palanquin.sim.scenarios import BarScenario
from palanquin.sim.scenarios.pilot import Pilot
from palanquin.sim.scenarios.script import Director
from palanquin.sim.scenes.bar_scene import build_bar_scene
from palanquin.sim.show.bar_motion import motion_of
from palanquin.sim.show.recording import write_recording
from palanquin.sim.show.render import Motion


class BarsDemo:
    """As of `Shown`; `has_keys`: somebody at the keyboard commands."""

    def __init__(self, scenario: BarScenario, has_keys: bool) -> None:
        self._scenario, self._has_keys = scenario, has_keys

    def run(self, progress: Bars) -> Record:
        """To the end or a fall."""
        scenario = self._scenario
        with _driving(scenario, self._has_keys) as director:
            loop = loop_of(scenario, director=director)
            self._record = loop.run(progress("walking", loop.most))
        self._shown = motion_of(self._record, build_bar_scene(scenario.team, scenario.ground))
        return self._record

    def settings(self) -> dict[str, Any]:
        """The scenario's fields."""
        return self._scenario.as_data()

    def more_figures(self) -> dict[str, Any]:
        """None."""
        return {}

    def record(self, path: Path) -> None:
        """Bodies, forces, plan and control."""
        write_recording(self._record, self._shown, path)

    def motion(self) -> Motion:
        """As simulated, or as shown of a reduced run."""
        return Motion(self._shown.scene.model, self._shown.time, self._shown.qpos)

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
        times = ", ".join(f"{name} {value:.2f}" for name, value in figures["solve_ms"].items())
        table.add_row("time of a plan, ms", times)
        table.add_row("fallbacks of the planner", f"{figures['fallbacks']}")
        if "control_ms_mean" in figures:
            share = f"{100 * figures['torque_fraction_max']:.0f} % of its limit"
            table.add_row("largest torque", share)
            mean = f"{1e3 * figures['control_ms_mean']:.0f} us"
            table.add_row("a robot's controller, mean", mean)
            table.add_row("its fallbacks", f"{figures['control_fallbacks']}")
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
    pilot = Pilot.of(scenario)
    err.print("; ".join(f"{keys}: {what}" for keys, what in pilot.keys), markup=False)

    def press(key: str) -> None:
        pilot.press(key)
        err.print(pilot.described(), markup=False)

    with open_keyboard() as keyboard:
        yield InStep(pilot, keyboard, press)
