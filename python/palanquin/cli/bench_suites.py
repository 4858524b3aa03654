"""`palanquin bench suites`: a collection of optimal control problems by every solver."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from palanquin.cli.bench_options import Folder, Headless, JsonFile, Resume, chosen, parts
from palanquin.cli.console import (
    check_writable,
    err,
    out,
    prepare_folder,
    reported_errors,
    write_json,
)

Problems = Annotated[
    str, typer.Option(metavar="NAME,...", help="Of the collection; all unless told.")
]
Solvers = Annotated[
    str, typer.Option(metavar="NAME;...", help='Such as "structured; osqp, exact".')
]
Random = Annotated[int, typer.Option(min=0, max=1000, help="Random starts besides rest and line.")]
References = Annotated[
    bool, typer.Option("--references", help="Make the reference optima anew by Ipopt first.")
]


def suites(
    problems: Problems = "",
    solvers: Solvers = "",
    random: Random = 1,
    references: References = False,
    folder: Folder = Path("out/bench-suites"),
    resume: Resume = False,
    json_file: JsonFile = None,
    headless: Headless = False,
) -> None:
    """Over 25 optimal control problems from rest, a straight line and random guesses.

    Every answer is judged by its KKT error, taken from the problem's statement by CasADi alone, and
    by Ipopt's cost from the same start. WRONG are plans called converged that are no KKT point, and
    "infeasible" for problems that all have solutions.
    """
    from palanquin.benchmarks.suites.references import load_references, make_references
    from palanquin.benchmarks.suites.report import report_suite
    from palanquin.benchmarks.suites.runs import run_suite
    from palanquin.benchmarks.suites.solvers import chosen as solvers_of
    from palanquin.problems.collection import COLLECTION

    with reported_errors():
        check_writable("--json", json_file)
        prepare_folder("--out", folder)
        by = solvers_of(parts(solvers, ";"))
        ocps = [COLLECTION[name] for name in chosen("--problems", problems, COLLECTION)]
        with err.status("lowering") as status:
            costs = make_references(ocps, status.update) if references else load_references()
            results = run_suite(ocps, by, costs, random, folder, resume, status.update)
        write_json("--out", folder / "results.json", results, indent=1)
        write_json("--json", json_file, results, indent=1)
        pictures = report_suite(results, folder, out)
    out.print("pictures:", *map(str, pictures), markup=False, highlight=False)
