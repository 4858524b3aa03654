"""The report: one page of Markdown with tables, pictures, and every event that should not be."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from palanquin.benchmarks.clm_paper.criteria import Criterion
from palanquin.benchmarks.clm_paper.figures_of_runs import Row
from palanquin.benchmarks.clm_paper.seeds import Runs
from palanquin.benchmarks.clm_paper.slopes import REACH, SLIP
from palanquin.benchmarks.ditch_formulations import Outcome
from palanquin.benchmarks.plots import PAPER_RATES
from palanquin.benchmarks.tables import solver_of

_PAPER_MACHINE = "i7-11800H, 2.30 GHz (De Vincenti and Coros, section IV-A)"


def report(
    runs: dict[str, Runs],
    teams: Sequence[Row],
    horizons: dict[str, Any],
    formulations: Sequence[Outcome],
    slopes: Sequence[Row],
) -> str:
    """The page; pictures are linked by their names in the same folder."""
    machine, revision = horizons["machine"], horizons["revision"]
    load = ", ".join(f"{value:.1f}" for value in machine["load_average"])
    parts = [
        "# De Vincenti and Coros, section IV, planned here",
        "Kinematic tracking: the bodies move on the planner's own model, disturbed where the text "
        "says so; there is no contact physics in it. Every run starts from a seed: 0 stands "
        "nominally, from 1 on bodies, velocities and feet are a little off.",
        f"{machine['cpu']}, {machine['threads_used']} of {machine['cores_allowed']} cores, load "
        f"{load}; kernels {machine['kernels']}; revision {revision}.",
        "## What each experiment shows",
        criteria_table(runs.values()),
        "## Push (Figure 5)",
        "![push](figure5.png)",
        "Robots pull the payload along its length, the pushed one back to its place; the other "
        "steps towards the payload. It does so when hand torques have a price: with Table I's "
        "weights they are all but free, hold every body level, and nobody steps but the one "
        "pushed.",
        "## Ditches (section IV-B)",
        "![ditches](ditches.png)",
        "One start and one SQP iteration a period: a foothold is put on the better side of a ditch "
        "when its touchdown comes into the horizon.",
        "### Formulations (Appendix A)",
        "![formulations](formulations.png)",
        _formulation_table(formulations),
        "## Ramp (Figures 6 and 7)",
        "![ramp](figure6.png)",
        "![legs](figure7.png)",
        _leg_table([r for name, r in runs.items() if name.startswith("ramp")]),
        "Slopes over friction, a trot at 0.4 m/s uphill; `slips` is the largest violation of a "
        f"friction pyramid in any plan. A slope works with at most {SLIP:g} N, no leg more than "
        f"{1e3 * REACH:g} mm over its limit, and no fall.",
        _slope_table(slopes),
        "## Rates (section IV-A)",
        "![rates](rates.png)",
        _rate_table(horizons["rows"]),
        "Whole plans, from measurement to plan with references and warm start; and in two phases, "
        "what is left to do when the measurement comes:",
        _team_table(teams),
        "## Fallbacks and late plans",
        _events([(name, row) for name, r in runs.items() for row in r.rows], teams),
    ]
    return "\n\n".join(parts) + "\n"


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)


def criteria_table(all_runs: Iterable[Runs]) -> str:
    """What each experiment asks of its runs, and how many show it."""
    head = ("experiment", "asked of each run", "runs that show it", "median", "worst")
    rows = [
        (runs.experiment.title if i == 0 else "", *_criterion_cells(criterion, runs.rows))
        for runs in all_runs
        for i, criterion in enumerate(runs.experiment.criteria)
    ]
    return table(head, rows)


def _criterion_cells(criterion: Criterion, rows: Sequence[Row]) -> tuple[str, str, str, str]:
    values = [criterion.value(row) for row in rows]
    shown = [criterion.holds(row) for row in rows]
    worst = min(values) if criterion.more_is_better else max(values)
    return (
        criterion.words,
        f"{sum(shown)} of {len(rows)}",
        f"{np.median(values):.3g}",
        f"{worst:.3g}",
    )


def _formulation_table(outcomes: Sequence[Outcome]) -> str:
    rows = [
        (
            o.formulation,
            f"{o.stiffness:g}",
            f"{100 * o.solved:.0f} %",
            f"{100 * o.feasible:.0f} %",
            f"{o.depth_mm:.3g}",
            f"{o.iterations:g}",
        )
        for o in outcomes
    ]
    head = ("formulation", "K", "converged", "within 1 mm", "deepest foothold, mm (median)")
    return table((*head, "iterations (median)"), rows)


def _leg_table(all_runs: Sequence[Runs]) -> str:
    rows = [
        (
            runs.experiment.title,
            len(runs.rows),
            f"{1e3 * max(row['leg_over_limit_m'] for row in runs.rows):.1f}",
            f"{1e3 * max(row['violation']['leg'] for row in runs.rows):.1f}",
            f"{1e2 * max(row['violation']['friction'] for row in runs.rows):.1f}",
        )
        for runs in all_runs
    ]
    head = ("run", "seeds", "leg over its limit, mm: walked", "planned", "friction, N: planned")
    return table(head, rows)


def _slope_table(rows: Sequence[Row]) -> str:
    frictions = sorted({row["friction"] for row in rows})
    cells = {(row["slope"], row["friction"]): _slope_cell(row) for row in rows}
    lines = [
        (f"{s:g} ({np.degrees(np.arctan(s)):.1f}°)", *(cells[s, mu] for mu in frictions))
        for s in sorted({row["slope"] for row in rows})
    ]
    return table(("slope", *(f"mu = {mu:g}" for mu in frictions)), lines)


def _slope_cell(row: Row) -> str:
    if row["works"]:
        return "works"
    if not row["completed"]:
        return "falls"
    slips = [f"slips, {row['slip_N']:.0f} N"] if row["slip_N"] > SLIP else []
    over = row["leg_over_limit_m"]
    return "; ".join(slips + ([f"legs {1e3 * over:.0f} mm over"] if over > REACH else []))


def _rate_table(rows: Sequence[Row]) -> str:
    lines: list[tuple[str, ...]] = [
        (
            f"{row['horizon_s']:.2f}",
            solver_of(row).label,
            f"{row['solve_ms']['p50']:.2f}",
            f"{row['solve_ms']['p99']:.2f}",
            f"{row['rate_hz']:.0f}",
            f"{row['python_ms']:.2f}",
        )
        for row in rows
        if row["solve_ms"]
    ]
    lines += [(f"{s:.2f}", _PAPER_MACHINE, "", "", f"{rate:g}", "") for s, rate in PAPER_RATES]
    head = ("horizon, s", "solver", "p50, ms", "p99, ms", "rate, Hz", "references and rest, ms")
    lines.sort(key=lambda line: float(line[0]))
    return table(head, lines)


def _team_table(rows: Sequence[Row]) -> str:
    head = ("team", "asked, Hz", "N", "p50, ms", "p95, ms", "p99, ms", "max, ms", "rate, Hz")
    lines = [
        (
            row["team"],
            f"{row['rate_hz']:g}",
            row["horizon"],
            *(f"{row['solve_ms'][q]:.2f}" for q in ("p50", "p95", "p99", "max")),
            f"{1e3 / row['solve_ms']['p50']:.0f}",
            f"{row['feedback_ms']['p50']:.2f}",
            f"{len(row['late'])} of {round(row['duration_s'] * row['rate_hz'])}",
        )
        for row in rows
    ]
    return table((*head, "feedback p50, ms", "later than the period"), lines)


def _events(rows: Sequence[tuple[str, Row]], teams: Sequence[Row]) -> str:
    late = sum(len(row["late"]) for row in teams)
    failed = sum(len(row["fallbacks"]) for row in teams)
    ticks = f"In the teams' runs at their own rates {late} plans were late and {failed} not usable."
    lines = [line for name, row in rows for line in _events_of(name, row)]
    if not lines:
        return f"None at 30 Hz: every solve gave a usable plan within its period. {ticks}"
    head = ("experiment", "seed", "what", "how often", "first at, s", "worst", "load then")
    return (
        f"{table(head, lines)}\n\nEvery one of them is in `results.json`. The load is that of the "
        f"machine when the run ended: above the number of its cores, others took turns. {ticks}"
    )


def _events_of(name: str, row: Row) -> list[tuple[str, ...]]:
    """A line for each kind of event that a run had."""
    run, load = (name, str(row["seed"])), f"{row['load']:.1f}"
    lines: list[tuple[str, ...]] = []
    for what, events in (("no usable plan", row["fallbacks"]), ("late", row["late"])):
        if events:
            worst = max(events, key=lambda event: event.get("ms", 0.0))
            words = f"{worst['ms']:.0f} ms" if what == "late" else worst["status"]
            first = f"{events[0]['time_s']:.2f}"
            lines.append((*run, what, str(len(events)), first, words, load))
    ladder = [(kind.replace("_", " "), n) for kind, n in row["events"].items() if n]
    return lines + [(*run, kind, str(n), "", "", load) for kind, n in ladder]
