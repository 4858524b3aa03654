"""Everything of the layered paper's reduced-order model in one folder: pictures and a report."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from palanquin.benchmarks.layered.figures import Drawn, draw_all
from palanquin.benchmarks.layered.survival import LOADS, Run, survival, survival_table
from palanquin.benchmarks.layered.timing import PAPER_MS, Row, measure_planners
from palanquin.benchmarks.machine import describe_machine, source_revision
from palanquin.problems.layered import VARIANTS
from palanquin.sim.scenarios.bar_planners import KINDS

FIGURES = 4
QUICK_LOADS = ("none", "sinusoid-40", "across-30", "payload-5", "unequal")

Progress = Callable[[str, int, int], None]


def reproduce(folder: Path, quick: bool, progress: Progress) -> tuple[dict[str, Any], list[Path]]:
    """Runs the experiments, draws and writes; `progress` is told part, done and total.

    Returns:
        All results, and the files written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    duration = 4.0 if quick else 10.0
    loads = QUICK_LOADS if quick else LOADS
    drawn: list[Drawn] = []
    for weights in VARIANTS:
        for item in draw_all(folder, weights, duration):
            drawn.append(item)
            progress("figures", len(drawn), FIGURES * len(VARIANTS))
    runs: list[Run] = []
    total = len(loads) * (1 + 2 * (len(KINDS) - 1))
    for run in survival(4.0 if quick else 8.0, loads):
        runs.append(run)
        progress("loads", len(runs), total)
    rows: list[Row] = []
    for row in measure_planners(200 if quick else 1000):
        rows.append(row)
        progress("times", len(rows), len(KINDS))
    results = {
        "figures": {item.file.stem: item.numbers for item in drawn},
        "survival": [asdict(run) for run in runs],
        "times": [row.to_json() for row in rows],
        "machine": describe_machine(),
        "revision": source_revision(),
    }
    results = _without_nan(results)
    report = folder / "report.md"
    report.write_text(_report(drawn, runs, rows, results), encoding="utf-8")
    data = folder / "results.json"
    data.write_text(json.dumps(results, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    return results, [*(item.file for item in drawn), report, data]


def times_table(rows: Sequence[Row]) -> str:
    """Markdown: a row per variant, medians and p99 in ms, beside the paper's."""
    lines = [
        "| planner | QP solver | build | solve | total p50 | p95 | p99 | max | paper | cost gap |",
        "|---" * 10 + "|",
    ]
    for row in rows:
        figures = row.to_json()
        paper = PAPER_MS.get(row.planner)
        total = figures.get("total_ms") or figures.get("solve_ms")
        cells = [row.planner, row.solver, *(_median(figures, f) for f in ("build_ms", "solve_ms"))]
        cells += [f"{total[q]:.3f}" if total else "" for q in ("p50", "p95", "p99", "max")]
        cells.append(f"{paper:g}" if paper else "")
        failed = f"{row.times.failures} failed" if row.times.failures else ""
        gap = "" if row.cost_gap is None else f"{row.cost_gap:.1e}"
        cells.append(" ".join(filter(None, (gap, failed, row.note))))
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _median(figures: dict[str, Any], phase: str) -> str:
    return f"{figures[phase]['p50']:.3f}" if phase in figures else ""


def _report(
    drawn: Sequence[Drawn], runs: Sequence[Run], rows: Sequence[Row], results: dict[str, Any]
) -> str:
    machine = results["machine"]
    parts = [
        "# Kim et al., reduced-order experiments, planned here",
        "Single rigid bodies on massless legs, exact multipliers: there is no contact physics in "
        "it. `working` are the default weights, `printed` the paper's.",
        f"{machine['cpu']}, revision {results['revision']}.",
        "## What is survived",
        survival_table(runs),
        "## Times in ms",
        "One robot's share for the distributed planner; totals include Python.",
        times_table(rows),
        "## Figures",
    ]
    for item in drawn:
        parts += [f"![{item.file.stem}]({item.file.name})", _numbers(item.numbers)]
    return "\n\n".join(parts) + "\n"


def _numbers(numbers: dict[str, Any]) -> str:
    return "\n".join(
        f"- {name}: " + ", ".join(f"{key} {_plain(value)}" for key, value in values.items())
        for name, values in numbers.items()
    )


def _plain(value: Any) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def _without_nan(value: Any) -> Any:
    """JSON knows neither NaN nor infinity: null stands for them."""
    if isinstance(value, dict):
        return {key: _without_nan(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_without_nan(entry) for entry in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
