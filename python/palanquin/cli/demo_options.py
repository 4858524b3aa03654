"""Options of the demos: each overrides a field of the scenario, or says where files go."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from palanquin.schema import LAST_SEED


class Tracking(StrEnum):
    """How the plan is followed."""

    KINEMATIC = "kinematic"
    PHYSICS = "physics"
    REDUCED = "reduced"


class State(StrEnum):
    """What is known of the state."""

    TRUE = "true"
    NOISY = "noisy"
    ESTIMATED = "estimated"


class PlannerName(StrEnum):
    """Who plans for robots on bars."""

    CENTRALIZED = "centralized"
    DISTRIBUTED = "distributed"
    NOMINAL = "nominal"


Source = Annotated[
    str,
    typer.Argument(
        metavar="NAME|FILE",
        help="A scenario that `palanquin scenario list` shows, or a scenario file.",
    ),
]
Robots = Annotated[
    int | None,
    typer.Option(help="How many carry, 1 to 4, all like the scenario's first one, in a row."),
]
GaitName = Annotated[
    str | None,
    typer.Option(help="Of all robots all the way: stand, trot, pace, bound, pronk or crawl."),
]
VelocityText = Annotated[
    str | None,
    typer.Option(
        metavar="VX[,VY[,WZ]]",
        help="Command to the payload in its heading frame: m/s forward, m/s left, rad/s.",
    ),
]
Commands = Annotated[
    Path | None,
    typer.Option(help="File of recorded commands, which `palanquin teleop --record` writes."),
]
Duration = Annotated[float | None, typer.Option(help="Of the run, s.")]
Horizon = Annotated[int | None, typer.Option(help="Planned intervals.")]
Rate = Annotated[float | None, typer.Option(help="Plans a second, Hz.")]
BackEnd = Annotated[
    str | None, typer.Option(help="Back end of the SQP's subproblem: structured, ldl, osqp.")
]
Seed = Annotated[
    int | None,
    typer.Option(
        min=0,
        max=LAST_SEED,
        help="Of random ditches, and of the start: 0 stands nominally; from 1 on bodies, "
        "velocities and feet are a little off (2 cm, 0.03 rad, 0.05 m/s).",
    ),
]
HowTracked = Annotated[
    Tracking | None,
    typer.Option(
        help="How the plan is followed: in physics unless told; with hands kinematic, joints by "
        "inverse kinematics; on bars reduced, to rigid bodies."
    ),
]

KnownState = Annotated[
    State | None,
    typer.Option(
        help="What planner and controllers know in physics: the state itself, with noise, or what "
        "an estimator makes of IMU, encoders and torques."
    ),
]

FaultTexts = Annotated[
    list[str] | None,
    typer.Option(
        "--fault",
        metavar="KIND[@TIME]",
        help="What breaks in physics, and when (2 s unless told): planner-silent, plans-late, "
        "state-lost, sensor-gone, motor-dead, hand-off, friction-lost. A scenario's `faults` say "
        "more.",
    ),
]

BarPlanner = Annotated[
    PlannerName | None,
    typer.Option(help="One QP for all, one a robot with what the others sent, or no bar known."),
]
BarRobots = Annotated[int | None, typer.Option(help="In a row, a bar between each two.")]
Load = Annotated[
    str | None, typer.Option(metavar="KG[@PLACE]", help="On each bar, unknown to the planner.")
]
GroundText = Annotated[
    str | None, typer.Option(metavar="KIND[:HEIGHT]", help="flat, rough or blocks; height in m.")
]
Friction = Annotated[float | None, typer.Option(help="Between feet and ground.")]
Step = Annotated[float | None, typer.Option(help="Height of the left half of the ground, m.")]
Softness = Annotated[
    float | None, typer.Option(help="Time constant of the ground, s; 0.005 is hard.")
]
Forces = Annotated[
    list[str] | None,
    typer.Option(
        metavar="SPEC",
        help="sin:20, sin:20,40,0, opposed:30, push:FX,FY,FZ@FROM,TO[:ROBOT] or "
        "pull:VX,VY@FROM,TO[:ROBOT]; N, m/s, s. May be given several times.",
    ),
]
Restrict = Annotated[
    str | None, typer.Option(metavar="AXES", help="The joints can't turn about: roll,pitch,yaw.")
]
BarVelocity = Annotated[
    str | None,
    typer.Option(
        metavar="VX[,VY[,WZ]]",
        help="Command, m/s and rad/s; for single robots between slashes, such as 0.15/0.",
    ),
]
Keys = Annotated[
    bool,
    typer.Option(
        "--keys",
        help="Drive by keyboard, in real time: arrows, a and d; tab: which robot; space: stop.",
    ),
]
Noise = Annotated[
    float | None, typer.Option(help="Of the sensors, as a multiple of a usual one's.")
]
Delay = Annotated[float | None, typer.Option(help="Of the measured state, s.")]
BarSeed = Annotated[
    int | None,
    typer.Option(
        min=0, max=LAST_SEED, help="Of terrain, noise and, from 1 on, a start a little off."
    ),
]

Headless = Annotated[
    bool | None,
    typer.Option(
        "--headless/--window",
        help="Without or with Rerun's viewer at the end; a window if there is a display.",
    ),
]
OutFolder = Annotated[Path, typer.Option("--out", help="Folder for all files.")]
JsonFile = Annotated[Path | None, typer.Option("--json", help="File for the figures instead.")]
Rrd = Annotated[Path | None, typer.Option("--rrd", help="File for the Rerun recording instead.")]
Video = Annotated[bool, typer.Option(help="Draw the video.")]
