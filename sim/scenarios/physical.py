"""A scenario as full physics asks for it."""

from __future__ import annotations

from palanquin.sim.scenarios.bars import BarScenario
from palanquin.sim.scenarios.files import AnyScenario
from palanquin.sim.scenarios.gait import GaitChoice
from palanquin.sim.scenarios.scenario import Scenario
from palanquin.sim.scenarios.settings import PlannerSettings

FRICTION_SHARE = 0.75
"""Of the ground's friction that a planner counts on: its cones are planned, not felt."""

TROT_PERIOD = 0.36
"""Of a trot that leaves its rhythm open, s: feet land where a push asks for them a quarter earlier
than in the planner's own 0.47 s.
"""

_PLANNER = {
    "rate": 100.0,
    "footholds": "raibert",
    "feet_below": "load",
    "ditch_margin": 0.01,
    "leg_torque": {},
    "arm_torque": {},
    "observers": {},
}
_WEIGHTS = {"foothold": (30.0, 30.0, 30.0), "torque": (1e-4, 1e-4, 1e-4)}


def in_physics(scenario: AnyScenario) -> AnyScenario:
    """The scenario as `physical` has it where hands carry and it is not told to be kinematic."""
    if isinstance(scenario, BarScenario) or scenario.tracking == "kinematic":
        return scenario
    return physical(scenario)


def physical(scenario: Scenario) -> Scenario:
    """The scenario with real bodies, and planned as motors and contacts want it where it does not
    say how.

    Arms have their masses and the payload the inertia of its shape, whatever the planner's model
    would do with; planner settings that the scenario leaves open are those that walk under torque
    limits: 100 plans a second, footholds that look ahead and are centred below robot and load,
    loosely held to their references, beyond a centimetre of ditches, hand torques with a price,
    forces and wrenches that the motors of standing legs and of arms can bear, and observers of what
    pushes robots and payload. A trot of open rhythm is quicker than in kinematic runs.
    """
    planner = scenario.planner
    weights = {k: v for k, v in _WEIGHTS.items() if k not in planner.weights.model_fields_set}
    chosen = {
        **_PLANNER,
        "friction": FRICTION_SHARE * scenario.world.friction,
        **{name: getattr(planner, name) for name in planner.model_fields_set},
        "weights": planner.weights.model_copy(update=weights),
    }
    payload = scenario.payload.model_copy(update={"inertia": None, "allow_unphysical": False})
    return scenario.changed(
        robots=tuple(
            robot.changed(arm="dynaarm", gait=_in_rhythm(robot.gait)) for robot in scenario.robots
        ),
        gait_changes=tuple(
            change.model_copy(update={"gait": _in_rhythm(change.gait)})
            for change in scenario.gait_changes
        ),
        payload=payload,
        planner=PlannerSettings(**chosen),
        tracking="physics",
    )


def _in_rhythm(gait: GaitChoice) -> GaitChoice:
    """The gait, a trot with the period that it leaves open."""
    if gait.name != "trot" or gait.period is not None:
        return gait
    return GaitChoice(name="trot", period=TROT_PERIOD, duty=gait.duty, offset=gait.offset)
