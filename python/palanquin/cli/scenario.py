"""`palanquin scenario`: the scenarios that there are, their files, and what is wrong with one."""

from __future__ import annotations

import json
from enum import StrEnum
from typing import Annotated

import typer
from rich.table import Table

from palanquin.cli.console import BAD_INPUT, err, out, reported_errors

app = typer.Typer(help="Scenarios: what they are, and whether a file is one.", no_args_is_help=True)

Source = Annotated[str, typer.Argument(metavar="NAME|FILE", help="A scenario, or its file.")]


class CarryName(StrEnum):
    """What carries."""

    HANDS = "hands"
    BARS = "bars"


Carry = Annotated[CarryName, typer.Option(help="Of files with this `carry`.")]


@app.command("list")
def show_all() -> None:
    """Lists the scenarios that come with the package."""
    from palanquin.sim.scenarios import BARS, SHIPPED, open_any

    table = Table(show_header=False, box=None)
    for name in (*SHIPPED, *BARS):
        scenario = open_any(name)
        table.add_row(name, f"{len(scenario.names)} robots", scenario.summary)
    out.print(table)


@app.command()
def show(name: Source) -> None:
    """Prints a scenario's file, to copy and change."""
    from palanquin.sim.scenarios import find_file

    with reported_errors():
        text = find_file(name).read_text(encoding="utf-8")
        out.print(text, end="", markup=False, highlight=False, soft_wrap=True)


@app.command()
def schema(carry: Carry = CarryName.HANDS) -> None:
    """Prints the JSON schema of scenario files, for editors."""
    from palanquin.sim.scenarios import schemas

    out.print_json(json.dumps(schemas()[carry.value]))


@app.command()
def fields(carry: Carry = CarryName.HANDS) -> None:
    """Prints every field of a scenario file with its kind, unit and default, as Markdown."""
    from palanquin.cli.scenario_fields import reference
    from palanquin.sim.scenarios import schemas

    text = reference(schemas()[carry.value])
    out.print(text, markup=False, highlight=False, soft_wrap=True)


@app.command()
def check(name: Source) -> None:
    """Says in words what is wrong with a scenario, by file and line where it can: values of the
    wrong kind, and what cannot be, such as a payload out of reach or a slope over the friction
    limit.

    Exit status: 0 it can be run, perhaps with warnings; 2 it cannot.
    """
    from palanquin.sim.feasibility import findings
    from palanquin.sim.scenarios import ScenarioFile, find_file

    with reported_errors():
        file = ScenarioFile(find_file(name))
        found = findings(file.scenario())
    for finding in found:
        kind = "error" if finding.is_error else "warning"
        line = file.described(finding.path, finding.message)
        err.print(f"{kind}: {line}", markup=False, highlight=False)
    if any(finding.is_error for finding in found):
        raise typer.Exit(BAD_INPUT)
    verdict = f"can be run; warnings: {len(found)}" if found else "nothing speaks against it"
    out.print(f"{name}: {verdict}", markup=False, highlight=False, soft_wrap=True)
