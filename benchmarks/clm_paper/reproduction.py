"""All experiments, pictures and tables of the paper, into one folder."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palanquin.benchmarks import ditch_formulations
from palanquin.benchmarks.clm_paper import rates
from palanquin.benchmarks.clm_paper.ditch_picture import draw_ditches
from palanquin.benchmarks.clm_paper.experiments import paper_experiments
from palanquin.benchmarks.clm_paper.push_picture import draw_push, hand_weights
from palanquin.benchmarks.clm_paper.ramp_picture import draw_ramp, draw_reach
from palanquin.benchmarks.clm_paper.report import report
from palanquin.benchmarks.clm_paper.seeds import Runs, SeedRunner
from palanquin.benchmarks.clm_paper.slopes import FRICTIONS, SLOPES, measure_slopes
from palanquin.benchmarks.machine import source_revision

Progress = Callable[[str, float, float], None]
"""Told of a part by its name, what is done of it, and its total."""


@dataclass(frozen=True)
class Effort:
    """How much is run.

    Attributes:
        seeds: runs of each experiment.
        repetitions: steps of each solver and horizon.
        stiffnesses: of the penalty, for the formulations of a ditch.
        slopes: of the ramp.
        frictions: mu on it.
    """

    seeds: int = 20
    repetitions: int = 100
    stiffnesses: tuple[float, ...] = ditch_formulations.STIFFNESSES
    slopes: tuple[float, ...] = SLOPES
    frictions: tuple[float, ...] = FRICTIONS

    def __post_init__(self) -> None:
        for name in ("seeds", "repetitions"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} is {getattr(self, name)}; at least 1 is needed")


QUICK = Effort(
    seeds=2, repetitions=20, stiffnesses=(1e2, 1e4, 1e6), slopes=(0.6, 0.8), frictions=(0.8,)
)


def reproduce(
    folder: Path, effort: Effort, resume: bool, progress: Progress
) -> tuple[dict[str, Any], list[Path]]:
    """Runs everything that the folder does not hold yet; writes pictures, `report.md` and
    `results.json`.

    Returns:
        The results as plain data, and the files.
    """
    folder.mkdir(parents=True, exist_ok=True)
    conditions = {"revision": source_revision()}
    runner = SeedRunner(folder, conditions, effort.seeds, resume)
    runs = {e.name: runner.run(e, counted(progress, e.name, runner.ticks(e)))
            for e in paper_experiments()}  # fmt: skip
    teams = rates.measure_teams(counted(progress, "teams", rates.team_ticks()))
    steps = rates.horizon_steps(folder, effort.repetitions)
    horizons = rates.measure_horizons(
        folder, effort.repetitions, resume, counted(progress, "horizons", steps)
    )
    formulations = ditch_formulations.compare(
        effort.seeds, effort.stiffnesses, lambda share: progress("formulations", share, 1.0)
    )
    cases = len(effort.slopes) * len(effort.frictions)
    sweep = measure_slopes(effort.slopes, effort.frictions, counted(progress, "slopes", cases))
    files = _draw(folder, runs)
    ditch_formulations.plot(formulations, folder / "formulations.png")
    page = folder / "report.md"
    page.write_text(report(runs, teams, horizons, formulations, sweep), encoding="utf-8")
    results = {
        "experiments": {name: r.rows for name, r in runs.items()},
        "criteria": {name: criteria_shown(r) for name, r in runs.items()},
        "teams": teams,
        "horizons": horizons["rows"],
        "formulations": ditch_formulations.to_rows(formulations),
        "slopes": sweep,
        "machine": horizons["machine"],
        "revision": horizons["revision"],
    }
    data = folder / "results.json"
    data.write_text(json.dumps(results, allow_nan=False, indent=1) + "\n", encoding="utf-8")
    pictures = [*files, folder / "formulations.png", folder / "rates.png"]
    return results, [page, data, *pictures]


def _draw(folder: Path, runs: dict[str, Runs]) -> list[Path]:
    """The pictures of single runs."""
    files = [folder / name for name in ("figure5.png", "ditches.png", "figure6.png", "figure7.png")]
    push, printed = runs["push"], runs["push-printed"]
    titles = hand_weights(push), f"{hand_weights(printed)} (Table I)"
    draw_push(push, printed, files[0], titles)
    draw_ditches(runs["ditch"], files[1])
    draw_ramp(runs["ramp"], files[2])
    papers = {
        "rigid (paper)": (runs["ramp-rigid"], runs["ramp-down-rigid"]),
        "rigid, K = 42 (Table I)": (runs["ramp-printed"], runs["ramp-down-printed"]),
    }
    draw_reach(runs["ramp"], runs["ramp-down"], papers, files[3])
    return files


def criteria_shown(runs: Runs) -> list[dict[str, Any]]:
    """How many runs show what is asked of each."""
    return [
        {
            "asked": criterion.words,
            "shown": sum(criterion.holds(row) for row in runs.rows),
            "runs": len(runs.rows),
        }
        for criterion in runs.experiment.criteria
    ]


def counted(progress: Progress, name: str, total: int) -> Callable[[int], None]:
    """Adds up what is done of one part."""
    done = 0
    progress(name, done, total)

    def advance(more: int) -> None:
        nonlocal done
        done += more
        progress(name, done, total)

    return advance
