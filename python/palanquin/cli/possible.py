"""What a look at a run beforehand finds, as the commands report it."""

from __future__ import annotations

from collections.abc import Iterable

from palanquin.cli.console import err
from palanquin.schema import dotted
from palanquin.sim.feasibility.finding import Finding


def require_possible(found: Iterable[Finding]) -> None:
    """Prints what is doubtful about a run; raises ValueError when it cannot be."""
    errors = []
    for finding in found:
        line = f"{dotted(finding.path)}: {finding.message}"
        if finding.is_error:
            errors.append(line)
        else:
            err.print(f"warning: {line}", markup=False, highlight=False, style="yellow")
    if errors:
        raise ValueError("this cannot be: " + "; ".join(errors))
