"""`palanquin demo`: a team walks, is watched and measured."""

from __future__ import annotations

from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from palanquin.cli.console import NOT_SOLVED, err, out, reported_errors, show_progress_of_lowering
from palanquin.cli.default_command import DEFAULT, DefaultCommandGroup
from palanquin.cli.demo_bar import bar
from palanquin.cli.demo_options import Headless, JsonFile, OutFolder, Rrd, Video
from palanquin.cli.watching import progress_bars, show, show_failed_plan
from palanquin.schema import LAST_SEED

if TYPE_CHECKING:  # imported late, so that --help is quick
    from palanquin.sim.scenarios import Scenario


app = typer.Typer(cls=DefaultCommandGroup, add_completion=False)
app.command()(bar)


class Tracking(StrEnum):
    """How the plan is followed."""

    KINEMATIC = "kinematic"
    PHYSICS = "physics"


@app.command(DEFAULT)
def demo(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME|FILE",
            help="A scenario that `palanquin scenario list` shows, or a scenario file.",
        ),
    ],
    robots: Annotated[
        int | None,
        typer.Option(help="How many carry, 1 to 4, all like the scenario's first one, in a row."),
    ] = None,
    gait: Annotated[
        str | None,
        typer.Option(help="Of all robots all the way: stand, trot, pace, bound, pronk or crawl."),
    ] = None,
    velocity: Annotated[
        str | None,
        typer.Option(
            metavar="VX[,VY[,WZ]]",
            help="Command to the payload in its heading frame: m/s forward, m/s left, rad/s.",
        ),
    ] = None,
    commands: Annotated[
        Path | None,
        typer.Option(help="File of recorded commands, which `palanquin teleop --record` writes."),
    ] = None,
    duration: Annotated[float | None, typer.Option(help="Of the run, s.")] = None,
    horizon: Annotated[int | None, typer.Option(help="Planned intervals.")] = None,
    rate: Annotated[float | None, typer.Option(help="Plans a second, Hz.")] = None,
    qp: Annotated[
        str | None, typer.Option(help="Back end of the SQP's subproblem: structured, ldl, osqp.")
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=LAST_SEED,
            help="Of random ditches, and of the start: 0 stands nominally; from 1 on bodies, "
            "velocities and feet are a little off (2 cm, 0.03 rad, 0.05 m/s).",
        ),
    ] = None,
    tracking: Annotated[
        Tracking,
        typer.Option(help="Inverse kinematics only, or a controller in simulated physics."),
    ] = Tracking.KINEMATIC,
    headless: Headless = None,
    out_folder: OutFolder = Path("out"),
    json_file: JsonFile = None,
    rrd: Rrd = None,
    video: Video = True,
) -> None:
    """Walks a team that is planned live, and writes a recording, a picture, a video and figures.

    `palanquin demo trot`: two armed Laikagos trot with a 16 kg beam. The first plan converges
    before the clock starts, while the robots stand; then each period has one SQP iteration.
    Options override what the scenario says.

    Exit status: 0 completed, 1 not completed, 2 bad input.
    """
    with reported_errors():
        from palanquin.cli.demo_files import DemoFiles
        from palanquin.cli.demo_scenario import (
            overridden,
            picture_share,
            settings_of,
        )
        from palanquin.cli.possible import require_possible
        from palanquin.sim.clearance import clearance_figures
        from palanquin.sim.feasibility import findings
        from palanquin.sim.figures import draw_figures
        from palanquin.sim.kinematic import track
        from palanquin.sim.recording import record
        from palanquin.sim.render import planned_motion
        from palanquin.sim.runs.loop import number_of_ticks
        from palanquin.sim.runs.run_outcome import outcome
        from palanquin.sim.runs.scenarios import run_scenario
        from palanquin.sim.scenarios import open_scenario

        scenario = overridden(
            open_scenario(name),
            commands=commands,
            robots=robots,
            gait=gait,
            velocity=velocity,
            duration=duration,
            seed=seed,
            horizon=horizon,
            rate=rate,
            qp=qp,
        )
        require_possible(findings(scenario))
        scenario.check_tracking(tracking.value)
        files = DemoFiles.prepare(scenario.name, out_folder, rrd, json_file, video)
        out.print(scenario.summary, markup=False)
        show_progress_of_lowering()
        with progress_bars() as progress:
            ticks = number_of_ticks(scenario.duration, scenario.planner.period)
            planner = scenario.build_planner()
            rollout = run_scenario(scenario, planner, progress("planning", ticks))
            trajectory = track(rollout, progress=progress("tracking", 1.0))
            figures = {
                "scenario": scenario.name,
                "tracking": tracking.value,
                "seed": scenario.seed,
                "robots": len(scenario.robots),
                "settings": settings_of(scenario, planner),
                **outcome(rollout),
                "kinematics": trajectory.summary(),
                **({"clearance": clearance_figures(trajectory)} if scenario.obstacles else {}),
            }
            written = files.write(
                figures,
                partial(draw_figures, rollout),
                partial(record, rollout, trajectory),
                planned_motion(trajectory, rollout),
                progress("video", 1.0),
                picture_share(rollout),
            )
    out.print(_table(_title(scenario), figures))
    for kind, path in written.items():
        out.print(f"{kind}: {path}", markup=False, highlight=False, soft_wrap=True)
    if not figures["completed"]:
        err.print(
            "not completed: " + ("a body fell" if figures["fell"] else "the plan diverged"),
            markup=False,
        )
        show_failed_plan(planner)
        raise typer.Exit(NOT_SOLVED)
    show(written, headless)


def _title(scenario: Scenario) -> str:
    gaits = dict.fromkeys(robot.gait.name for robot in scenario.robots)
    return f"{scenario.name}: {len(scenario.robots)} robots, {', '.join(gaits)}"


def _table(title: str, figures: dict[str, Any]) -> Table:
    error = figures["payload_position_error_m"]
    table = Table(title=title, show_header=False)
    table.add_row("completed", "yes" if figures["completed"] else "no")
    table.add_row(
        "duration, distance", f"{figures['duration_s']:.1f} s, {figures['distance_m']:.2f} m"
    )
    table.add_row(
        "payload position error after 1 s",
        f"rms {1e3 * error['rms']:.3g} mm, max {1e3 * error['max']:.3g} mm",
    )
    table.add_row("worst violation (m, 100 N)", _listed(figures["violation"], ".2g"))
    if "clearance" in figures:
        distances = {kind: least["distance_m"] for kind, least in figures["clearance"].items()}
        table.add_row("smallest distances, m", _listed(distances, ".3f"))
    table.add_row("time of a plan, ms", _listed(figures["solve_ms"], ".2f"))
    table.add_row("the solver's part, ms", _listed(figures["solver_ms"], ".2f"))
    table.add_row(
        "deadline misses, fallbacks", f"{figures['deadline_misses']}, {figures['fallbacks']}"
    )
    events = {name: count for name, count in figures["events"].items() if count > 0}
    table.add_row("events", _listed(events, "d") if events else "none: full steps throughout")
    return table


def _listed(values: dict[str, float], form: str) -> str:
    return ", ".join(f"{name} {value:{form}}" for name, value in values.items())
