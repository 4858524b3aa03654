"""Which slopes can be walked with which friction: a ramp's slope against mu."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from palanquin.benchmarks.clm_paper.experiments import planned
from palanquin.benchmarks.clm_paper.figures_of_runs import Row, figures_of
from palanquin.problems.modules.limits import FORCE_UNIT
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import Scenario, open_scenario

SLOPES = (0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
FRICTIONS = (0.6, 0.8, 1.0)

SLIP = 2.0
"""A plan that breaks a friction pyramid by more than this, N, would slip."""

REACH = 1e-3
"""A leg may be too short by so much, m."""


def slope_scenario(slope: float, friction: float) -> Scenario:
    """The paper's ramp with another slope, climbed in one trot at 0.4 m/s."""
    ramp = open_scenario("ramp")
    return planned(ramp, friction=friction).changed(
        terrain={**ramp.terrain.model_dump(), "kappa": slope},
        command={"type": "velocity", "steps": [{"vx": 0.4}]},
        gait_changes=[],
        duration=13.0,
    )


def measure_slopes(
    slopes: tuple[float, ...], frictions: tuple[float, ...], progress: Callable[[int], None]
) -> list[Row]:
    """A row for each slope and friction; `progress` is told of each that is done."""
    rows = []
    for slope in slopes:
        for friction in frictions:
            scenario = slope_scenario(slope, friction)
            rows.append(_row(slope, friction, figures_of(scenario, run_scenario(scenario))))
            progress(1)
    return rows


def _row(slope: float, friction: float, figures: Row) -> dict[str, Any]:
    slip = FORCE_UNIT * max(figures["violation"][family] for family in ("friction", "normal"))
    over = figures["violation"]["leg"]
    return {
        "slope": slope,
        "friction": friction,
        "works": bool(figures["completed"] and slip <= SLIP and over <= REACH),
        "completed": figures["completed"],
        "slip_N": slip,
        "leg_over_limit_m": over,
        "payload_rms_m": figures["payload_position_error_m"]["rms"],
    }
