"""Push, ditches and ramp of the paper in full physics, beside what it shows kinematically."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from palanquin.benchmarks.clm_paper.criteria import COMPLETED, Criterion, at_most
from palanquin.benchmarks.clm_paper.ditch_picture import draw_ditches
from palanquin.benchmarks.clm_paper.experiments import Experiment, paper_experiments
from palanquin.benchmarks.clm_paper.figures_of_runs import Row
from palanquin.benchmarks.clm_paper.push_picture import draw_push
from palanquin.benchmarks.clm_paper.ramp_picture import draw_ramp
from palanquin.benchmarks.clm_paper.report import criteria_table, table
from palanquin.benchmarks.clm_paper.reproduction import Effort, Progress, counted, criteria_shown
from palanquin.benchmarks.clm_paper.seeds import Runs, SeedRunner
from palanquin.benchmarks.machine import source_revision
from palanquin.sim.scenarios.physical import physical

SHOWN = {
    "push": (5.0, "The push, trampling on the spot"),
    "push-stand": (1.5, "The push, standing"),
    "ditch": (0.5, "12 random ditches up to 32 cm wide"),
    "ramp": (1.0, "The ramp of 38.7 degrees, climbed"),
    "ramp-down": (1.0, "The ramp, descended"),
}
"""Largest rms error of the payload that is asked, cm, and the title."""

_IN_DITCHES = at_most("touchdowns in ditches", lambda row: row["touchdowns"]["in_ditches"], 0)


def experiments() -> tuple[Experiment, ...]:
    """The paper's, in physics, and the push of a team that stands."""
    papers = {experiment.name: experiment for experiment in paper_experiments()}
    push = papers["push"].scenario
    robots = [robot.changed(gait="stand") for robot in push.robots]
    scenarios = {
        **{name: papers[name].scenario for name in SHOWN if name in papers},
        "push-stand": push.changed(robots=robots, gait_changes=[]),
    }
    return tuple(
        Experiment(
            name,
            title,
            physical(scenarios[name]),
            papers[name.removesuffix("-stand")].measure,
            _asked(name, limit),
        )
        for name, (limit, title) in SHOWN.items()
    )


def _asked(name: str, limit: float) -> tuple[Criterion, ...]:
    error = at_most(
        "payload's error, cm rms", lambda row: 1e2 * row["payload_position_error_m"]["rms"], limit
    )
    torque = at_most("largest torque over its limit", lambda row: row["torque_fraction_max"], 1.0)
    return (COMPLETED, error, torque, *([_IN_DITCHES] if name == "ditch" else []))


def reproduce_in_physics(
    folder: Path, effort: Effort, resume: bool, progress: Progress
) -> tuple[dict[str, Any], list[Path]]:
    """Runs so many seeds of what the folder does not hold yet; writes pictures, `report.md` and
    `results.json`.

    Returns:
        The results as plain data, and the files.
    """
    folder.mkdir(parents=True, exist_ok=True)
    revision = source_revision()
    runner = SeedRunner(folder, {"revision": revision}, effort.seeds, resume)
    runs = {
        e.name: runner.run(e, counted(progress, e.name, runner.ticks(e))) for e in experiments()
    }
    pictures = [folder / f"{name}.png" for name in ("push", "ditches", "ramp", "ramp-down")]
    draw_push(runs["push"], runs["push-stand"], pictures[0], ("trampling", "standing"))
    draw_ditches(runs["ditch"], pictures[1])
    draw_ramp(runs["ramp"], pictures[2])
    draw_ramp(runs["ramp-down"], pictures[3])
    page, data = folder / "report.md", folder / "results.json"
    page.write_text(_report(runs, revision), encoding="utf-8")
    results = {
        "experiments": {name: r.rows for name, r in runs.items()},
        "criteria": {name: criteria_shown(r) for name, r in runs.items()},
        "revision": revision,
    }
    data.write_text(json.dumps(results, allow_nan=False, indent=1) + "\n", encoding="utf-8")
    return results, [page, data, *pictures]


def _report(runs: dict[str, Runs], revision: str) -> str:
    parts = [
        "# De Vincenti and Coros, section IV, in full physics",
        "Contact forces and torque limits in MuJoCo, plans at 100 Hz, control at 1 kHz. Every run "
        "starts from a seed: 0 stands nominally, from 1 on bodies, velocities and feet are a "
        f"little off. Revision {revision}.",
        criteria_table(runs.values()),
        "## What limits it",
        limits_table(runs.values()),
        "## Push (Figure 5)",
        "![push](push.png)",
        "## Ditches (section IV-B)",
        "![ditches](ditches.png)",
        "## Ramp (Figure 6)",
        "![ramp](ramp.png)",
        "![ramp, down](ramp-down.png)",
    ]
    return "\n\n".join(parts) + "\n"


def limits_table(all_runs: Iterable[Runs]) -> str:
    """Of each experiment: motors at their limits, slip, solves and controllers that fell back, and
    how runs ended that did not go through.
    """
    head = ("experiment", "motors at limit, median", "worst slip, mm", "fallbacks", "falls")
    return table(head, [_limits(runs) for runs in all_runs])


def _limits(runs: Runs) -> tuple[str, ...]:
    rows: list[Row] = runs.rows
    ends = Counter(row["fall"]["cause"] for row in rows if row["fell"])
    fallbacks = sum(len(row["fallbacks"]) + row["control_fallbacks"] for row in rows)
    return (
        runs.experiment.title,
        f"{100 * np.median([row['saturated_share'] for row in rows]):.2g} %",
        f"{1e3 * max(row['slip_m'] for row in rows):.2g}",
        str(fallbacks),
        ", ".join(f"{count}: {cause}" for cause, count in ends.items()) or "none",
    )
