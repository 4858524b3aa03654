"""`palanquin figures PAPER`: figures and tables of a paper, measured here; one module a paper."""

from __future__ import annotations

import typer

from palanquin.cli import figures_clm, figures_layered

app = typer.Typer(
    help="Run a paper's experiments and write its figures, tables and a report into a folder.",
    no_args_is_help=True,
)
app.command("clm")(figures_clm.clm)
app.command("layered")(figures_layered.layered)


@app.callback()
def figures() -> None:
    """Run a paper's experiments and write its figures, tables and a report into a folder."""
