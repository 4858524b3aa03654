"""`palanquin bench qps FOLDER`: QPs from files by our back end and by peers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from palanquin.cli.bench_options import Headless, JsonFile, chosen
from palanquin.cli.console import (
    check_writable,
    err,
    out,
    prepare_folder,
    reported_errors,
    write_json,
)
from palanquin.errors import ProblemError

Folder = Annotated[
    Path, typer.Argument(metavar="FOLDER", help="Of .npz, .mat or acados' .json files.")
]
Solvers = Annotated[
    str, typer.Option(metavar="NAME,...", help="Such as structured,piqp; all unless told.")
]
Repetitions = Annotated[
    int, typer.Option(min=1, max=10_000, help="Solves of each QP; the median counts.")
]
Pictures = Annotated[
    Path | None, typer.Option("--out", metavar="FOLDER", help="For the performance profile.")
]


def qps(
    folder: Folder,
    solvers: Solvers = "",
    repetitions: Repetitions = 5,
    pictures: Pictures = None,
    json_file: JsonFile = None,
    headless: Headless = False,
) -> None:
    """QPs of the public benchmarks, or your own, each from cold.

    A QP counts as solved where its KKT error, scaled, is at most 1e-6. Peers are those of PIQP,
    OSQP, ProxQP and DAQP that are installed (pip install piqp osqp proxsuite daqp), and HPIPM of
    CasADi's wheel for QPs by stages. Set-up is not timed, but for DAQP.
    """
    from palanquin.benchmarks.qps.comparison import qp_paths, report_qps, run_qps
    from palanquin.benchmarks.qps.solvers import NAMES, installed

    with reported_errors():
        check_writable("--json", json_file)
        if pictures is not None:
            prepare_folder("--out", pictures)
        if not folder.is_dir():
            raise ProblemError(f"{folder} is no folder")
        known = installed()
        names = chosen("--solvers", solvers, NAMES) if solvers else list(known)
        for name in names:
            if name not in known:
                raise ProblemError(f"--solvers {name!r}: it is not installed")
        by = {name: known[name] for name in names}
        with err.status("reading") as status:
            results = run_qps(qp_paths(folder), by, repetitions, status.update)
        write_json("--json", json_file, results)
    report_qps(results, out, pictures)
