"""The command `palanquin`: one module a command.

Exit status: 0 done, 1 not solved or not completed, 2 bad input, 130 stopped by Ctrl-C.
"""

from __future__ import annotations

from typing import Annotated

import typer

from palanquin.cli import (
    bench,
    bench_holonomic,
    bench_loops,
    bench_qps,
    bench_rates,
    bench_suites,
    bench_whole_body,
    campaign,
    demo,
    figures,
    scenario,
)
from palanquin.cli.check import check
from palanquin.cli.solve import solve
from palanquin.cli.teleop import teleop
from palanquin.versions import versions

app = typer.Typer(
    name="palanquin",
    help="Trajectory optimization for teams of robots that carry a payload together.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_show_locals=False,
)
app.command()(solve)
app.command()(check)
app.command()(teleop)
app.add_typer(demo.app, name="demo")
app.add_typer(scenario.app, name="scenario")
bench.app.command("holonomic")(bench_holonomic.holonomic)
bench.app.command("whole-body")(bench_whole_body.whole_body)
bench.app.command("suites")(bench_suites.suites)
bench.app.command("loops")(bench_loops.loops)
bench.app.command("qps")(bench_qps.qps)
bench.app.command("rates")(bench_rates.rates)
app.add_typer(bench.app, name="bench")
app.add_typer(campaign.app, name="campaign")
app.add_typer(figures.app, name="figures")


def _show_versions(is_asked: bool) -> None:
    if is_asked:
        for name, version in versions().items():
            print(name, version)
        raise typer.Exit


@app.callback()
def main(
    _version: Annotated[
        bool,
        typer.Option(
            "--version",
            callback=_show_versions,
            is_eager=True,
            help="Print the versions of palanquin and of what it is linked with.",
        ),
    ] = False,
) -> None:
    """Trajectory optimization for teams of robots that carry a payload together."""
