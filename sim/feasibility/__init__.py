"""Is a scenario possible at all? Rules of thumb from geometry and statics, in words.

What passes may still fail: only a run shows whether a plan exists.
"""

from __future__ import annotations

from palanquin.sim.feasibility import bars
from palanquin.sim.feasibility.ends import ground_to_walk_on
from palanquin.sim.feasibility.finding import Finding
from palanquin.sim.feasibility.ground import ditches_to_step_over, slopes_to_stand_on
from palanquin.sim.feasibility.obstacles import obstacles_beside_the_way
from palanquin.sim.feasibility.payload import weight_to_hold
from palanquin.sim.feasibility.reach import heights_to_hold
from palanquin.sim.feasibility.room import grasps_apart, grasps_on_the_payload, trunks_apart
from palanquin.sim.feasibility.start import feet_at_the_start
from palanquin.sim.feasibility.timing import knots_in_every_step, plans_in_time, ticks_to_plan
from palanquin.sim.feasibility.walking import flights_to_survive, speeds_to_walk
from palanquin.sim.scenarios import AnyScenario, BarScenario

RULES = (
    ticks_to_plan,
    plans_in_time,
    knots_in_every_step,
    feet_at_the_start,
    weight_to_hold,
    heights_to_hold,
    grasps_apart,
    grasps_on_the_payload,
    trunks_apart,
    slopes_to_stand_on,
    ground_to_walk_on,
    ditches_to_step_over,
    obstacles_beside_the_way,
    flights_to_survive,
    speeds_to_walk,
)
"""Each looks at a scenario and yields its findings."""


def findings(scenario: AnyScenario) -> list[Finding]:
    """What is impossible or doubtful about a scenario, errors first."""
    if isinstance(scenario, BarScenario):
        return bars.findings(scenario)
    found = [finding for rule in RULES for finding in rule(scenario)]
    return sorted(found, key=lambda finding: not finding.is_error)


__all__ = ["RULES", "Finding", "findings"]
