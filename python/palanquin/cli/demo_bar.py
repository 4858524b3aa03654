"""`palanquin demo bar`: robots on a bar walk in full physics."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from enum import StrEnum
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from palanquin.cli.console import NOT_SOLVED, err, out, reported_errors, show_progress_of_lowering
from palanquin.cli.demo_options import Headless, JsonFile, OutFolder, Rrd, Video
from palanquin.cli.watching import progress_bars, show
from palanquin.schema import LAST_SEED

if TYPE_CHECKING:  # imported late, so that --help is quick
    from palanquin.cli.keyboard import Keyboard
    from palanquin.sim.bar.driver import Driver
    from palanquin.sim.bar.scenario import BarScenario
    from palanquin.sim.scenarios.script import Director, Orders


class PlannerName(StrEnum):
    """Who plans."""

    CENTRALIZED = "centralized"
    DISTRIBUTED = "distributed"
    NOMINAL = "nominal"


class BarTracking(StrEnum):
    """How the plan is followed."""

    PHYSICS = "physics"


def bar(
    planner: Annotated[
        PlannerName,
        typer.Option(
            help="One QP for all, one a robot with what the others sent, or no bar known."
        ),
    ] = PlannerName.CENTRALIZED,
    robots: Annotated[int, typer.Option(help="In a row, a bar between each two.")] = 2,
    payload: Annotated[
        str, typer.Option(metavar="KG[@PLACE]", help="On each bar, unknown to the planner.")
    ] = "0",
    terrain: Annotated[
        str, typer.Option(metavar="KIND[:HEIGHT]", help="flat, rough or blocks; height in m.")
    ] = "flat",
    friction: Annotated[float, typer.Option(help="Between feet and ground.")] = 0.6,
    step: Annotated[float, typer.Option(help="Height of the left half of the ground, m.")] = 0.0,
    softness: Annotated[
        float, typer.Option(help="Time constant of the ground, s; 0.005 is hard.")
    ] = 0.005,
    force: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SPEC",
            help="sin:20, sin:20,40,0, opposed:30, push:FX,FY,FZ@FROM,TO[:ROBOT] or "
            "pull:VX,VY@FROM,TO[:ROBOT]; N, m/s, s. May be given several times.",
        ),
    ] = None,
    restrict: Annotated[
        str, typer.Option(metavar="AXES", help="The joints can't turn about: roll,pitch,yaw.")
    ] = "",
    velocity: Annotated[
        str,
        typer.Option(
            metavar="VX[,VY[,WZ]]",
            help="Command, m/s and rad/s; for single robots between slashes, such as 0.15/0.",
        ),
    ] = "0.5",
    keys: Annotated[
        bool,
        typer.Option(
            "--keys",
            help="Drive by keyboard, in real time: arrows, a and d; tab: which robot; space: stop.",
        ),
    ] = False,
    noise: Annotated[
        float, typer.Option(help="Of the sensors, as a multiple of a usual one's.")
    ] = 0.0,
    delay: Annotated[float, typer.Option(help="Of the measured state, s.")] = 0.0,
    duration: Annotated[float, typer.Option(help="Of the run, s.")] = 10.0,
    seed: Annotated[
        int,
        typer.Option(
            min=0, max=LAST_SEED, help="Of terrain, noise and, from 1 on, a start a little off."
        ),
    ] = 0,
    tracking: Annotated[
        BarTracking, typer.Option(help="There is only physics here.")
    ] = BarTracking.PHYSICS,
    headless: Headless = None,
    out_folder: OutFolder = Path("out"),
    json_file: JsonFile = None,
    rrd: Rrd = None,
    video: Video = True,
) -> None:
    """Walks A1s that carry bars on ball joints: MPC at 200 Hz, whole-body control at 1 kHz.

    `palanquin demo bar --payload 5 --terrain rough:0.05 --force sin:20`: rough ground, a load of
    5 kg that no planner knows of, and sinusoidal forces on both robots. A fall ends the run.

    Exit status: 0 completed, 1 fallen, 2 bad input.
    """
    with reported_errors():
        from palanquin.cli.demo_files import DemoFiles
        from palanquin.cli.possible import require_possible
        from palanquin.problems.clm.references import Velocity
        from palanquin.sim.bar import texts
        from palanquin.sim.bar.feasibility import findings
        from palanquin.sim.bar.planners import build_planner
        from palanquin.sim.bar.plots import draw_plots
        from palanquin.sim.bar.recording import write_recording
        from palanquin.sim.bar.scenario import BarScenario, Sensors
        from palanquin.sim.bar.scene import build_bar_scene
        from palanquin.sim.bar.team import BarTeam
        from palanquin.sim.render import Motion
        from palanquin.sim.runs.run_outcome import outcome
        from palanquin.sim.runs.scenarios import run_bars, ticks_of

        mass, place = texts.parse_payload(payload)
        axes = tuple(axis for axis in restrict.split(",") if axis)
        velocities = texts.parse_velocities(velocity)
        scenario = BarScenario(
            team=BarTeam(robots, payload=mass, payload_at=place, restrict=axes),
            ground=texts.parse_ground(
                terrain, seed, friction=friction, step=step, softness=softness
            ),
            planner=planner.value,
            velocity=velocities[0] if len(velocities) == 1 else Velocity(),
            velocities=velocities if len(velocities) > 1 else (),
            forces=tuple(f for text in force or () for f in texts.parse_force(text, robots)),
            sensors=Sensors.usual(noise, delay),
            duration=duration,
            seed=seed,
        )
        if not keys:
            require_possible(findings(scenario))
        files = DemoFiles.prepare("bar", out_folder, rrd, json_file, video)
        out.print(_summary(scenario), markup=False)
        show_progress_of_lowering()
        with progress_bars() as progress, _driving(scenario, keys) as director:
            planning = build_planner(scenario)
            ticks = ticks_of(scenario, planning.settings.dt)
            record = run_bars(scenario, planning, director, progress("walking", ticks))
            scene = build_bar_scene(scenario.team, scenario.ground)
            figures = {
                "scenario": "bar",
                "tracking": tracking.value,
                "seed": seed,
                "robots": robots,
                "settings": {
                    "planner": planner.value, "payload": payload, "terrain": terrain,
                    "friction": friction, "step": step, "softness": softness,
                    "force": force or [], "restrict": restrict, "velocity": velocity,
                    "noise": noise, "delay": delay,
                },
                **outcome(record),
            }  # fmt: skip
            written = files.write(
                figures,
                partial(draw_plots, record),
                partial(write_recording, record, scene),
                Motion(scene.model, record.time, record.more["qpos"]),
                progress("video", 1.0),
            )
    out.print(_table(figures))
    for kind, path in written.items():
        out.print(f"{kind}: {path}", markup=False, highlight=False, soft_wrap=True)
    if record.fall:
        err.print(f"fell after {record.duration:.2f} s: {record.fall}", markup=False)
        if record.events:
            err.print(f"{len(record.events)} samples had no plan of their own; the last:")
        for event in record.events[-3:]:
            err.print(f"  {event.time:.3f} s: {event.reason}", markup=False, highlight=False)
        raise typer.Exit(NOT_SOLVED)
    show(written, headless)


@contextmanager
def _driving(scenario: BarScenario, has_keys: bool) -> Iterator[Director | None]:
    """Commands from the keyboard in step with the wall's clock, if they are asked for."""
    if not has_keys:
        yield None
        return
    from palanquin.cli.keyboard import open_keyboard
    from palanquin.sim.bar.driver import HELP, Driver

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


def _summary(scenario: BarScenario) -> str:
    team, ground = scenario.team, scenario.ground
    load = f"with {team.payload:g} kg on each bar" if team.payload else "without a load"
    where = ground.kind if ground.kind == "flat" else f"{ground.kind} ({ground.height:g} m)"
    return f"{team.robots} A1s on bars walk on {where} ground {load}, planned {scenario.planner}."


def _table(figures: dict[str, Any]) -> Table:
    table = Table(title=f"bar: {figures['settings']['planner']}", show_header=False)
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
    table.add_row("largest torque", f"{100 * figures['torque_fraction_max']:.0f} % of its limit")
    times = ", ".join(f"{name} {value:.2f}" for name, value in figures["solve_ms"].items())
    table.add_row("time of a plan, ms", times)
    table.add_row("a robot's controller, mean", f"{1e3 * figures['control_ms_mean']:.0f} us")
    table.add_row(
        "fallbacks of planner, controllers",
        f"{figures['fallbacks']}, {figures['control_fallbacks']}",
    )
    table.add_row("faster than real time", f"{figures['real_time_factor']:.2f} times")
    return table
