"""Every setting of a scenario reaches what it names."""

from dataclasses import fields, replace
from itertools import islice

import mujoco
import numpy as np
import pytest

from palanquin.problems import gaits
from palanquin.problems.modules.wrench_cone import WrenchCone
from palanquin.problems.planning import Velocity
from palanquin.sim.runs.hands_physics import held_scene
from palanquin.sim.runs.scenarios import loop_of, run_scenario
from palanquin.sim.scenarios import Scenario, open_scenario
from palanquin.sim.scenarios.bar_ground import Ground
from palanquin.sim.scenarios.bar_planners import KINDS
from palanquin.sim.scenarios.bar_team import BarTeam
from palanquin.sim.scenarios.bars import BarScenario
from palanquin.sim.scenarios.command import VelocityChange
from palanquin.sim.scenarios.gait import GaitChange, GaitChoice
from palanquin.sim.scenarios.physical import physical
from palanquin.sim.scenarios.route import payload_route
from palanquin.sim.scenarios.sensors import Sensors
from palanquin.sim.scenarios.settings import PlannerSettings, WeightSettings
from palanquin.sim.scenarios.world import World
from palanquin.sim.scenes.bar_scene import build_bar_scene

TROT = open_scenario("trot")


def planned_with(**settings):
    return TROT.changed(planner=settings)


def parameter(name):
    return lambda planner: planner.params[name][0].ravel().tolist()


def held(planner):
    return planner.params["left.hold"].ravel().tolist() if "left.hold" in planner.params else []


def torque_limits(limb):
    name = f"left.{limb}_torque_limits"
    return lambda p: p.params[name][0].tolist() if name in p.params else []


CONE = {"grip": 111.0, "friction": 0.11, "torsion": 0.011, "half_size": 0.0111}
WEIGHTS = {
    "position": ("left.weight.position", [1.5, 2.5, 3.5]),
    "orientation": ("left.weight.orientation", 4.5),
    "velocity": ("left.weight.velocity", [5.5, 6.5, 7.5]),
    "angular_velocity": ("left.weight.angular_velocity", [8.5, 9.5, 10.5]),
    "foothold": ("left.weight.foothold", [11.5, 12.5, 13.5]),
    "force": ("left.weight.force", [0.5, 0.25, 0.125]),
    "torque": ("left.weight.hand_torque", [0.75, 0.5, 0.25]),
    "payload": ("payload.weight.importance", 14.5),
    "terminal": ("left.weight.terminal", 15.5),
}
# field: (value, what the planner has of it, what that must be)
PLANNER = {
    "horizon": (7, lambda p: p.horizon, 7),
    "dt": (0.02, lambda p: p.dt, 0.02),
    "iterations": (3, lambda p: p.sqp.settings.max_iterations, 3),
    "inner_iterations": (5, lambda p: p.sqp.settings.subproblem.max_inner_iterations, 5),
    "qp": ("ldl", lambda p: p.sqp.settings.qp, "ldl"),
    "threads": (2, lambda p: p.sqp.settings.threads, 2),
    "candidates": (3, lambda p: p.candidates and len(p.candidates.solvers), 3),
    "references": ("rigid", lambda p: p._robot_references, "rigid"),
    "footholds": ("raibert", lambda p: p.footholds, "raibert"),
    "feet_below": ("load", lambda p: p.team.feet_below, "load"),
    "input_blocks": (3, lambda p: held(p)[:7], [0, 1, 1, 0, 1, 1, 0]),
    "leg_torque": ({"share": 0.5}, torque_limits("leg"), [10.0, 27.5, 27.5]),
    "arm_torque": ({"share": 0.5}, torque_limits("arm"), [20.0] * 4),
    "friction": (0.55, parameter("terrain.friction"), [0.55]),
}
ELSEWHERE = {"rate", "ditch_margin", "weights", "hand_cone", "penalties", "clearance", "observers"}
ELSEWHERE |= {"latency", "lost"}  # in test_plan_link.py


def test_the_tables_have_every_setting():
    assert PLANNER.keys() | ELSEWHERE == set(PlannerSettings.model_fields)
    assert WEIGHTS.keys() == WeightSettings.model_fields.keys()
    assert CONE.keys() == vars(WrenchCone()).keys()


@pytest.mark.parametrize("field", PLANNER)
def test_a_planner_setting_reaches_the_planner(field):
    value, read, expected = PLANNER[field]
    assert read(planned_with().build_planner()) != expected
    assert read(planned_with(**{field: value}).build_planner()) == expected


@pytest.mark.parametrize("field", WEIGHTS)
def test_a_weight_reaches_the_planner(field):
    name, value = WEIGHTS[field]
    planner = planned_with(weights={field: value}).build_planner()
    assert parameter(name)(planner) == pytest.approx(np.ravel(value).tolist())


def test_clearance_and_obstacles_reach_the_planner():
    box = {"type": "box", "centre": [9, 9], "size": [1, 1]}
    planner = planned_with(clearance=0.07).changed(obstacles=[box]).build_planner()
    assert parameter("clearance")(planner) == [0.07]
    assert parameter("obstacles")(planner)[:2] == [9, 9]


def test_a_margin_beside_ditches_reaches_the_planner():
    line = {"a": 1, "b": 0, "c": -2, "d": 0.1}
    scenario = planned_with(ditch_margin=0.03).changed(ditches={"type": "lines", "lines": [line]})
    np.testing.assert_allclose(scenario.build_planner().ditches, [[1, 0, -2, 0.16]])
    assert scenario.ditch_lines[0][3] == 0.1


def test_a_hand_cone_reaches_the_planner():
    planner = planned_with(hand_cone=CONE).build_planner()
    assert parameter("left.hand.cone")(planner) == list(WrenchCone(**CONE).values())


def test_a_penalty_reaches_the_planner():
    planner = planned_with(penalties={"leg": {"stiffness": 77.0, "smoothing": 0.5}}).build_planner()
    state = TROT.start_state()
    state.bodies[1, 2] += 0.3  # beyond the legs
    stiff = planned_with(penalties={"leg": {"stiffness": 7700.0, "smoothing": 0.5}}).build_planner()
    costs = [p.solve(0.0, state, TROT.command.at(0.0)).plan.penalty_cost for p in (planner, stiff)]
    assert costs[1] > 2 * costs[0] > 0


def test_the_rate_and_the_duration_reach_the_run():
    rollout = run_scenario(planned_with(rate=50.0).changed(duration=0.1))
    np.testing.assert_allclose(rollout.time, 0.02 * np.arange(5))


# What a run is made of, as far as fields other than the planner's decide it.
OTHERS = {
    "robots": {"robots": [TROT.robots[0].changed(model="a1"), TROT.robots[1]]},
    "robots.arm": {"robots": [TROT.robots[0].changed(arm="dynaarm"), TROT.robots[1]]},
    "robots.attach": {"robots": [TROT.robots[0].changed(attach=(0.0, 0.7, 0.0)), TROT.robots[1]]},
    "robots.yaw": {"robots": [TROT.robots[0].changed(yaw=0.2), TROT.robots[1]]},
    "robots.gait": {"robots": [TROT.robots[0].changed(gait="pace"), TROT.robots[1]]},
    "payload.mass": {"payload": {"mass": 11.0}},
    "payload.height": {"payload": {"height": 0.45}},
    "payload.inertia": {"payload": {"inertia": [2.0, 2.0, 2.0]}},
    "payload.shape": {"payload": {"shape": {"type": "box", "size": [0.1, 1.5, 0.1]}}},
    "terrain": {"terrain": {"type": "plane", "z0": 0.1, "ax": 0.1, "ay": 0.0}},
    "ditches": {"ditches": {"type": "lines", "lines": [{"a": 1, "b": 0, "c": -2, "d": 0.1}]}},
    "start_pose": {"start_pose": {"x": 0.3}},
    "command": {"command": {"type": "velocity", "steps": [{"vx": 0.1}]}},
    "gait_changes": {"gait_changes": [{"time": 0.0, "gait": "pace", "at_once": True}]},
    "pushes": {"pushes": [{"body": "left", "force": [0, 9, 0], "start": 0, "duration": 1}]},
    "seed": {"seed": 4},
}
NOT_OF_THE_RUN = {"carry", "name", "summary", "tracking"}
TESTED_ELSEWHERE = {"planner", "duration", "obstacles", "world"}
TESTED_ELSEWHERE |= {"state", "sensors"}  # in test_known_states.py
TESTED_ELSEWHERE |= {"faults"}  # in test_faults.py


def essence(scenario):
    """The first tick of a run and its scene, as numbers and text."""
    planner = scenario.build_planner(max_iterations=1)
    tick = next(loop_of(scenario, planner).ticks())
    state = scenario.start_state()
    return (
        scenario.scene.to_json(),
        planner.params.values.round(9).tobytes(),
        state.bodies.round(9).tobytes(),
        planner.contacts(np.linspace(0, 1, 50)).tobytes(),
        tick.orders,
        tick.values["disturbance"].tobytes(),
        payload_route(scenario).round(9).tobytes(),
    )


@pytest.fixture(scope="module")
def plain():
    return essence(TROT)


def test_the_table_has_every_field_of_a_scenario():
    covered = {name.partition(".")[0] for name in OTHERS}
    assert covered | NOT_OF_THE_RUN | TESTED_ELSEWHERE == set(Scenario.model_fields)


@pytest.mark.parametrize("name", OTHERS)
def test_a_field_reaches_the_run(name, plain):
    assert essence(TROT.changed(**OTHERS[name])) != plain


def test_the_worlds_friction_reaches_ground_and_controllers():
    scenario = TROT.changed(world={"friction": 0.37})
    assert set(World.model_fields) == {"friction", "payload_mass", "robot_mass"}
    assert physical(scenario).planner.friction == pytest.approx(0.75 * 0.37)
    assert held_scene(scenario).model.geom("ground").friction[0] == 0.37


@pytest.mark.parametrize("field", [f.name for f in fields(Sensors)])
def test_a_sensor_setting_reaches_the_measurement(field):
    settings = replace(Sensors(), **{field: 0.003}).settings(seed=5)
    assert getattr(settings, field) == (3 if field == "delay" else 0.003)
    assert settings.seed == 5
    others = [f.name for f in fields(Sensors) if f.name != field]
    assert all(getattr(settings, other) == 0 for other in others)


BAR = BarScenario(duration=2.0)
# What a run on bars is made of, by field.
BARS = {
    "team": {"team": BarTeam(payload=3.0)},
    "ground": {"ground": Ground(step=0.05)},
    "planner": {"planner": "nominal"},
    "velocity": {"velocity": Velocity(0.2)},
    "velocities": {"velocities": (Velocity(0.5), Velocity(0.4))},
    "ramp": {"ramp": 0.2},
    "velocity_changes": {"velocity_changes": (VelocityChange(time=0.8, vx=0.1),)},
    "gait": {"gait": GaitChoice(name="pace", period=0.4)},
    "gait_changes": {
        "gait_changes": (GaitChange(time=0.0, gait=GaitChoice(name="trot"), robots=("left",)),)
    },
    "forces": {"forces": ("push:0,20,0@0,1",)},
    "sensors": {"sensors": Sensors(position=0.01)},
    "friction": {"friction": 0.3},
    "duration": {"duration": 1.0},
    "distance": {"distance": 1e-3},
    "seed": {"seed": 4},
    "tracking": {"tracking": "reduced"},
}
REDUCED = BARS.keys() - {"ground", "sensors", "tracking"}


def essence_of_bars(scenario):
    """The first ticks of a run on bars, and what is told over its time, as numbers."""
    loop = loop_of(scenario)
    ticks = list(islice(loop.ticks(), 3))
    told = [scenario.at(time, np.zeros(3), 0.005).velocities for time in (0.4, 0.6, 1.0, 1.6)]
    contacts = loop.plant.contacts(np.linspace(0, 2, 60))
    settings = loop.planner.planner.settings
    return (
        loop.most,
        [tick.seen.bodies.round(9).tolist() for tick in ticks],
        [{name: values.tolist() for name, values in tick.values.items()} for tick in ticks],
        [tick.plan.forces.round(6).tolist() for tick in ticks],
        loop.is_over(ticks[0], farther(ticks[0])),
        told,
        contacts.tolist(),
        settings.friction,
        type(loop.planner.planner),
    )


def farther(tick):
    """The tick as if the team had come 1 cm."""
    bodies = tick.seen.bodies + 0.01 * np.eye(13)[0]
    return replace(tick, seen=replace(tick.seen, bodies=bodies))


@pytest.fixture(scope="module")
def plain_bars():
    return {
        tracking: essence_of_bars(BAR.changed(tracking=tracking))
        for tracking in ("physics", "reduced")
    }


def test_the_table_has_every_field_of_a_run_on_bars():
    assert BARS.keys() | {"carry", "name", "summary"} == {f.name for f in fields(BarScenario)}


@pytest.mark.parametrize("name", BARS)
def test_a_field_reaches_the_run_on_bars(name, plain_bars):
    assert essence_of_bars(BAR.changed(**BARS[name])) != plain_bars["physics"]


@pytest.mark.parametrize("name", sorted(REDUCED))
def test_a_field_reaches_the_reduced_run(name, plain_bars):
    scenario = BAR.changed(tracking="reduced", **BARS[name])
    assert essence_of_bars(scenario) != plain_bars["reduced"]


def test_the_friction_reaches_the_controllers():
    """Who count on less keep to narrower pyramids, whatever plans for them."""
    pushed = []
    for friction in (0.6, 0.02):
        scenario = BAR.changed(friction=friction, forces=("push:0,30,0@0,1",))
        loop = loop_of(scenario, BAR.build_planner())
        *_, last = islice(loop.ticks(), 10)
        forces = last.values["foot_force"]
        pushed.append(np.abs(forces[..., :2]).sum() / forces[..., 2].sum())
    assert pushed[1] < 0.05 < pushed[0] / 2


def test_the_gait_and_its_start_reach_the_controllers():
    plant = loop_of(BAR.changed(gait=GaitChoice(name="crawl"))).plant
    times = np.linspace(0, 3, 200)
    wanted = gaits.crawl().stands((times - 0.5) / 1.2)
    wanted[times < 0.5 - 1e-6] = True
    np.testing.assert_array_equal(plant.contacts(times), wanted[:, None].repeat(2, axis=1))


def test_the_restricted_axes_reach_the_reduced_plant():
    free, held = (
        loop_of(BAR.changed(tracking="reduced", team=BarTeam(restrict=axes)))
        for axes in ((), ("yaw",))
    )
    rows = [len(next(loop.ticks()).values["multipliers"]) for loop in (free, held)]
    assert rows == [1, 3]


def test_what_planner_and_controllers_of_a_bar_are_told():
    scenario = BarScenario(team=BarTeam(3), ground=Ground(friction=0.4), planner="distributed")
    planner = scenario.build_planner()
    assert isinstance(planner, KINDS["distributed"])
    assert planner.settings.friction == 0.4
    assert replace(scenario, friction=0.3).build_planner().settings.friction == 0.3
    loop = loop_of(replace(scenario, seed=3), planner)
    reference = next(loop.ticks()).plan.reference
    assert reference.shape == (3, 13)
    assert abs(reference[0, 6]) > 1e-3  # turned by the seed


@pytest.mark.parametrize(
    ("team", "read", "expected"),
    [
        (BarTeam(bar_mass=0.7), lambda m: m.body("bar1").mass[0], 0.7),
        (BarTeam(bar_mass=0.3, payload=4.0), lambda m: m.body("bar1").mass[0], 4.3),
        (BarTeam(2, 1.0, 1e-3, 20.0, payload_at=0.0), lambda m: m.body("bar1").ipos[1], 0.5),
        (BarTeam(length=1.4), lambda m: 2 * m.geom(m.body("bar1").geomadr[0]).size[1], 1.4),
        (BarTeam(4), lambda m: sum(m.body(i).name.startswith("bar") for i in range(m.nbody)), 3),
        (BarTeam(restrict=("roll",)), lambda m: (m.eq_type == mujoco.mjtEq.mjEQ_WELD).sum(), 2),
    ],
)  # fmt: skip
def test_a_field_of_a_bar_team_reaches_the_scene(team, read, expected):
    model = build_bar_scene(team, Ground()).model
    assert read(model) == pytest.approx(expected, abs=2e-3)


@pytest.mark.parametrize(
    ("ground", "read"),
    [
        (Ground(friction=0.33), lambda m: (m.geom_friction[:, 0] == 0.33).any()),
        (Ground(softness=0.02), lambda m: (m.geom_solref[:, 0] == 0.02).any()),
        (Ground(step=0.07), lambda m: np.isclose(m.geom_size[:, 2], 0.035).any()),
        (Ground("rough", height=0.11), lambda m: 0.1 < m.hfield_size[0, 2] <= 0.11),
    ],
)  # fmt: skip
def test_a_field_of_a_bar_ground_reaches_the_scene(ground, read):
    assert read(build_bar_scene(BarTeam(), ground).model)
