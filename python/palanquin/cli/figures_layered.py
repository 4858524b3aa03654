"""`palanquin figures layered`: the reduced-order experiments of Kim et al."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markdown import Markdown
from rich.progress import Progress, TaskID

from palanquin.cli.bench_options import Folder, Headless, JsonFile
from palanquin.cli.console import (
    check_writable,
    err,
    out,
    prepare_folder,
    reported_errors,
    write_json,
)


def layered(
    quick: Annotated[
        bool, typer.Option("--quick", help="About two minutes: short walks, few loads.")
    ] = False,
    folder: Folder = Path("out/figures-layered"),
    json_file: JsonFile = None,
    headless: Headless = False,
) -> None:
    """Two robots on a bar: figures of Kim et al., loads survived, and times.

    On the reduced-order plant, working and printed weights side by side, Figures 8, 9, 22 and 23;
    in full physics Figures 10, 12 to 18, 20, 24 and 25. About fifteen minutes.
    """
    with reported_errors():
        from palanquin.benchmarks.layered.physics import physics_table, reproduce_physics
        from palanquin.benchmarks.layered.report import reproduce

        check_writable("--json", json_file)
        prepare_folder("--out", folder)
        with Progress(console=err) as bar:
            tasks: dict[str, TaskID] = {}

            def progress(part: str, done: int, total: int) -> None:
                if part not in tasks:
                    tasks[part] = bar.add_task(part, total=total)
                bar.update(tasks[part], completed=done)

            results, files = reproduce(folder, quick, progress)
            rows, drawn = reproduce_physics(folder, 3.0 if quick else 10.0, progress)
        results["physics"] = rows
        files += drawn
        write_json("--json", json_file, results)
    report = next(file for file in files if file.name == "report.md").read_text(encoding="utf-8")
    out.print(Markdown(report.split("## Figures")[0]))
    out.print(Markdown(f"## Full physics\n\n{physics_table(rows)}"))
    for file in files:
        out.print(str(file), markup=False, highlight=False, soft_wrap=True)
