"""`palanquin bench NAME`: how fast a plan is made, by which solver, on this machine."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from palanquin.cli.bench_options import Headless, JsonFile, Resume, parts
from palanquin.cli.console import (
    check_writable,
    err,
    out,
    prepare_folder,
    reported_errors,
    write_json,
    writing,
)
from palanquin.schema import LAST_SEED

if TYPE_CHECKING:
    from palanquin.benchmarks.variant import Variant

app = typer.Typer(help="Measure planning steps on this machine.", no_args_is_help=True)

MOST_STEPS = 1_000_000
MOST_INTERVALS = 1000

Integers = Annotated[str, typer.Option(metavar="N,N,...")]
Qp = Annotated[str, typer.Option(metavar="NAME,...", help="Back ends; all unless told.")]
Threads = Annotated[int, typer.Option(min=1, max=64, help="For linearising and evaluating knots.")]
Repetitions = Annotated[
    int,
    typer.Option(
        min=1, max=MOST_STEPS, help="Recorded steps of each variant; of cold ones a tenth."
    ),
]
Seed = Annotated[
    int, typer.Option(min=0, max=LAST_SEED, help="Of the disturbances, equal for all variants.")
]
Folder = Annotated[
    Path | None,
    typer.Option("--out", metavar="FOLDER", help="For pictures and rows.", show_default="out/..."),
]
Rrd = Annotated[Path | None, typer.Option(metavar="FILE", help="For a Rerun recording of rates.")]


@app.command()
def horizon(
    robots: Annotated[int, typer.Option(help="Size of the team, 1 to 16.")] = 2,
    horizons: Integers = "5,10,15,20,31",
    qp: Qp = "",
    threads: Threads = 1,
    repetitions: Repetitions = 300,
    seed: Seed = 0,
    folder: Folder = None,
    resume: Resume = False,
    json_file: JsonFile = None,
    rrd: Rrd = None,
    headless: Headless = False,
) -> None:
    """Rate of closed-loop planning against the horizon, for each QP back end."""
    from palanquin.benchmarks.horizon import horizon_variants, report_horizon

    with reported_errors():
        outputs = _Outputs(folder or Path("out/bench-horizon"), json_file, rrd)
        variants = horizon_variants(robots, _integers("--horizons", horizons), parts(qp), threads)
        _measure(variants, repetitions, seed, resume, outputs, report_horizon)


@app.command()
def solver(
    robots: Integers = "1,2,3,4",
    horizons: Integers = "15,20,31",
    qp: Qp = "",
    threads: Threads = 1,
    long: Annotated[
        bool, typer.Option("--long", help="Horizons of 60 and 120 too, for the slope.")
    ] = False,
    ditches: Annotated[bool, typer.Option(help="Each task with 12 ditches too.")] = True,
    quick: Annotated[
        bool, typer.Option("--quick", help="One minute: R = 1 and 2, N = 15, flat, 30 steps.")
    ] = False,
    repetitions: Repetitions = 300,
    seed: Seed = 0,
    folder: Folder = None,
    resume: Resume = False,
    json_file: JsonFile = None,
    rrd: Rrd = None,
    headless: Headless = False,
) -> None:
    """Every QP back end over teams and horizons, warm and cold, flat and with ditches."""
    from palanquin.benchmarks.solver import report_solver, solver_variants

    if quick:
        robots, horizons, long, ditches, repetitions = "1,2", "15", False, False, 30
    with reported_errors():
        outputs = _Outputs(folder or Path("out/bench-solver"), json_file, rrd)
        variants = solver_variants(
            _integers("--robots", robots),
            _integers("--horizons", horizons),
            parts(qp),
            threads,
            with_long=long,
            with_ditches=ditches,
        )
        _measure(variants, repetitions, seed, resume, outputs, report_solver)


@app.command()
def peers(
    robots: Annotated[int, typer.Option(help="Size of the team, 1 to 16.")] = 2,
    horizon: Annotated[
        int, typer.Option(min=1, max=MOST_INTERVALS, help="Intervals of 1/30 s.")
    ] = 15,
    acados: Annotated[
        Path | None,
        typer.Option(metavar="VENV", help="A virtual environment with comma-deps-acados."),
    ] = None,
    repetitions: Annotated[
        int, typer.Option(min=1, max=MOST_STEPS, help="Problems that each peer solves.")
    ] = 20,
    seed: Seed = 0,
    folder: Folder = None,
    json_file: JsonFile = None,
    headless: Headless = False,
) -> None:
    """The same problems by CasADi with Ipopt, fatrop, OSQP and HPIPM, and by acados."""
    from palanquin.benchmarks.peers.comparison import report_peers, run_peers
    from palanquin.benchmarks.variant import Task

    with reported_errors():
        outputs = _Outputs(folder or Path("out/bench-peers"), json_file, None)
        if acados is None:
            err.print("acados is skipped: --acados VENV names an environment that has it")
        task = Task(robots, horizon)
        with err.status("lowering") as status:
            results = run_peers(
                task, repetitions, seed, outputs.folder, acados, lambda text: status.update(text)
            )
        outputs.write(results)
        report_peers(results, outputs.folder, out)


@dataclass(frozen=True)
class _Outputs:
    """Where results go; refuses unusable places before anything is measured."""

    folder: Path
    json_file: Path | None
    rrd: Path | None

    def __post_init__(self) -> None:
        check_writable("--json", self.json_file)
        check_writable("--rrd", self.rrd)
        prepare_folder("--out", self.folder)

    def write(self, results: dict[str, Any]) -> None:
        """All rows, into the folder and to --json."""
        write_json("--out", self.folder / "results.json", results, indent=1)
        write_json("--json", self.json_file, results, indent=1)


Report = Callable[[dict[str, Any], Path, Console], list[Path]]


def _measure(
    variants: list[Variant],
    repetitions: int,
    seed: int,
    resume: bool,
    outputs: _Outputs,
    report: Report,
) -> None:
    from palanquin.benchmarks import recording
    from palanquin.benchmarks.measurement import Measurement

    measurement = Measurement(repetitions, seed, outputs.folder, resume)
    with _progress(measurement.total(variants)) as (advance, announce):
        results = measurement.run(variants, advance, announce)
    outputs.write(results)
    if outputs.rrd is not None:
        with writing("--rrd", outputs.rrd):
            recording.record(results["rows"], outputs.rrd)
    pictures = report(results, outputs.folder, out)
    out.print("pictures:", *map(str, pictures), markup=False, highlight=False)


@contextmanager
def _progress(total: int) -> Iterator[tuple[Callable[[int], None], Callable[[str], None]]]:
    columns = [TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()]
    with Progress(*columns, TimeRemainingColumn(), console=err) as bar:
        task = bar.add_task("lowering", total=total)
        yield (
            lambda steps: bar.advance(task, steps),
            lambda text: bar.update(task, description=text),
        )


def _integers(option: str, text: str) -> list[int]:
    try:
        values = [int(part) for part in text.split(",")]
    except ValueError:
        raise ValueError(f"{option} {text!r}: integers separated by commas are needed") from None
    if min(values) < 1 or len(set(values)) < len(values):
        raise ValueError(f"{option} {text!r}: values must be at least 1, and differ")
    if max(values) > MOST_INTERVALS:
        raise ValueError(f"{option} {text!r}: values must be at most {MOST_INTERVALS}")
    return values
