"""`palanquin demo`: a team walks, is watched and measured."""

from __future__ import annotations

from pathlib import Path

import typer

from palanquin.cli.console import reported_errors
from palanquin.cli.default_command import DEFAULT, DefaultCommandGroup
from palanquin.cli.demo_options import (
    BackEnd,
    BarPlanner,
    BarRobots,
    BarSeed,
    BarVelocity,
    Commands,
    Delay,
    Duration,
    FaultTexts,
    Forces,
    Friction,
    GaitName,
    GroundText,
    Headless,
    Horizon,
    HowTracked,
    JsonFile,
    Keys,
    KnownState,
    Load,
    Noise,
    OutFolder,
    Rate,
    Restrict,
    Robots,
    Rrd,
    Seed,
    Softness,
    Source,
    Step,
    VelocityText,
    Video,
)

app = typer.Typer(cls=DefaultCommandGroup, add_completion=False)


@app.command(DEFAULT)
def demo(
    name: Source, robots: Robots = None, gait: GaitName = None, velocity: VelocityText = None,
    commands: Commands = None, duration: Duration = None, horizon: Horizon = None,
    rate: Rate = None, qp: BackEnd = None, seed: Seed = None, tracking: HowTracked = None,
    fault: FaultTexts = None,
    state: KnownState = None,
    headless: Headless = None, out_folder: OutFolder = Path("out"), json_file: JsonFile = None,
    rrd: Rrd = None, video: Video = True,
) -> None:  # fmt: skip
    """Walks a team that is planned live, and writes a recording, a picture, a video and figures.

    `palanquin demo trot`: two armed Laikagos trot with a 16 kg beam. The first plan converges
    before the clock starts, while the robots stand; then each period has one SQP iteration.
    Options override what the scenario says.

    Exit status: 0 completed, 1 not completed, 2 bad input.
    """
    with reported_errors():
        from palanquin.cli.demo_overrides import overridden
        from palanquin.cli.demo_run import Places, walk
        from palanquin.sim.scenarios import open_any

        scenario = overridden(
            open_any(name), commands=commands, robots=robots, gait=gait, velocity=velocity,
            duration=duration, seed=seed, horizon=horizon, rate=rate, qp=qp, tracking=tracking,
            state=state, faults=fault,
        )  # fmt: skip
        walk(scenario, Places(out_folder, rrd, json_file, video), headless)


@app.command()
def bar(
    planner: BarPlanner = None, robots: BarRobots = None, payload: Load = None,
    terrain: GroundText = None, friction: Friction = None, step: Step = None,
    softness: Softness = None, force: Forces = None, restrict: Restrict = None,
    velocity: BarVelocity = None, commands: Commands = None, keys: Keys = False,
    noise: Noise = None, delay: Delay = None, duration: Duration = None, seed: BarSeed = None,
    tracking: HowTracked = None,
    headless: Headless = None, out_folder: OutFolder = Path("out"), json_file: JsonFile = None,
    rrd: Rrd = None, video: Video = True,
) -> None:  # fmt: skip
    """Walks A1s that carry bars on ball joints: MPC at 200 Hz, whole-body control at 1 kHz.

    `palanquin demo bar --payload 5 --terrain rough:0.05 --force sin:20`: rough ground, a load of
    5 kg that no planner knows of, and sinusoidal forces on both robots. A fall ends the run.
    Options override the scenario `bar`; `palanquin demo FILE` runs others with `carry: bars`.

    Exit status: 0 completed, 1 fallen, 2 bad input.
    """
    with reported_errors():
        from palanquin.cli.demo_overrides import bars_overridden
        from palanquin.cli.demo_run import Places, walk
        from palanquin.sim.scenarios import open_any

        scenario = bars_overridden(
            open_any("bar"), planner=planner, robots=robots, payload=payload, terrain=terrain,
            friction=friction, step=step, softness=softness, forces=force, restrict=restrict,
            velocity=velocity, noise=noise, delay=delay, duration=duration, seed=seed,
            tracking=tracking, commands=commands,
        )  # fmt: skip
        walk(scenario, Places(out_folder, rrd, json_file, video), headless, keys)
