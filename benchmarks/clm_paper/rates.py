"""How fast plans are made: against the horizon (section IV-A), and for teams at their rates."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from palanquin.benchmarks.clm_paper.experiments import planned
from palanquin.benchmarks.clm_paper.figures_of_runs import Row, figures_of
from palanquin.benchmarks.horizon import horizon_variants
from palanquin.benchmarks.measurement import Measurement
from palanquin.benchmarks.plots import plot_rate_over_horizon
from palanquin.sim.runs.loop import number_of_ticks
from palanquin.sim.runs.nominal import follow
from palanquin.sim.runs.run_outcome import percentiles
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import Scenario, open_scenario

HORIZONS = [15, 20, 31]
"""Of 1/30 s: the paper's 0.5, 0.66 and 1.03 s."""

BACK_ENDS = ["structured", "osqp"]

TEAMS = {
    "two robots, 0.5 s": ("trot", 15, 1000.0),
    "four mixed robots, 1 s": ("team4", 30, 200.0),
}
"""Scenario, number of intervals and asked rate (Hz) by what the report calls it."""

TEAM_DURATION = 4.0
"""Of a team's run, s."""

FEEDBACK_TICKS = 300
"""Plans of a team that are made in two phases."""


def team_scenarios() -> dict[str, Scenario]:
    """The runs of `TEAMS`, each planned as often as is asked."""
    return {
        name: planned(open_scenario(scenario), horizon=horizon, rate=rate).changed(
            duration=TEAM_DURATION
        )
        for name, (scenario, horizon, rate) in TEAMS.items()
    }


def team_ticks() -> int:
    """How many plans `measure_teams` makes."""
    scenarios = team_scenarios().values()
    return sum(number_of_ticks(s.duration, s.planner.period) + FEEDBACK_TICKS for s in scenarios)


def measure_teams(progress: Callable[[int], None]) -> list[Row]:
    """Figures of the teams' runs, each planned at its asked rate; a plan's time has its references
    and warm start in it. `progress` is told how many ticks more are done.
    """
    rows = []
    for name, scenario in team_scenarios().items():
        rollout = run_scenario(scenario, progress=lambda tick: progress(1))
        row = figures_of(scenario, rollout)
        row |= {"team": name, "robots": len(scenario.robots), "rate_hz": scenario.planner.rate}
        times = feedback_times(scenario, FEEDBACK_TICKS)
        progress(FEEDBACK_TICKS)
        rows.append({**row, "horizon": scenario.planner.horizon, "feedback_ms": percentiles(times)})
    return rows


def feedback_times(scenario: Scenario, ticks: int) -> list[float]:
    """Milliseconds of the feedback phase of so many plans, each prepared for the state that the
    nominal model then has.
    """
    planner, period = scenario.build_planner(), scenario.planner.period
    command = scenario.command.start().velocity(0.0, planner.reference, period)
    state, times = scenario.start(planner), []
    planner.settle(0.0, state, command)
    for tick in range(ticks):
        time = tick * period
        planner.prepare(time, state, command)
        plan = planner.feedback(state)
        times.append(plan.solve_ms)
        _, state = follow(planner, plan, state, period)
    return times


def measure_horizons(
    folder: Path, repetitions: int, resume: bool, progress: Callable[[int], None]
) -> dict[str, Any]:
    """`palanquin bench horizon` on the paper's horizons, `repetitions` steps each; draws the plot
    into the folder.
    """
    results = _measurement(folder, repetitions, resume).run(_variants(), progress)
    title = "Rate over horizon, two robots in trot"
    plot_rate_over_horizon(results["rows"], title, folder / "rates.png")
    return results


def horizon_steps(folder: Path, repetitions: int) -> int:
    """How many steps `measure_horizons` takes."""
    return _measurement(folder, repetitions, resume=True).total(_variants())


def _measurement(folder: Path, repetitions: int, resume: bool) -> Measurement:
    return Measurement(repetitions, 0, folder / "horizons", resume)


def _variants() -> list[Any]:
    return horizon_variants(2, HORIZONS, BACK_ENDS)
