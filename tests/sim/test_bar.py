"""Robots on bars: scenes, texts, and a short closed loop in full physics."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from palanquin.problems import quaternions
from palanquin.problems.layered.reference import STANDING_HEIGHT
from palanquin.problems.planning import Velocity
from palanquin.problems.robots import A1
from palanquin.sim.errors import InputError
from palanquin.sim.feasibility.bars import findings
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import loop_of, run_scenario
from palanquin.sim.scenarios import bar_texts as texts
from palanquin.sim.scenarios.bar_forces import Force, Rope
from palanquin.sim.scenarios.bar_ground import Ground
from palanquin.sim.scenarios.bar_planners import PHYSICS
from palanquin.sim.scenarios.bar_team import ATTACH, AXES, BarTeam
from palanquin.sim.scenarios.bars import BarScenario
from palanquin.sim.scenarios.script import Orders
from palanquin.sim.scenarios.sensors import Sensors
from palanquin.sim.scenes.bar_scene import build_bar_scene


@pytest.fixture(scope="module", params=["centralized", "distributed"])
def walk(request):
    """Three seconds at 0.4 m/s with an unknown load of 5 kg, a little off at the start."""
    scenario = BarScenario(
        team=BarTeam(payload=5.0),
        planner=request.param,
        velocity=Velocity(0.4),
        duration=3.0,
        seed=1,
    )
    return run_scenario(scenario)


def test_robots_weigh_what_is_published_and_stand_at_their_height():
    scene = build_bar_scene(BarTeam(), Ground())
    data = scene.data()
    for name, lane in (("left", 0.5), ("right", -0.5)):
        trunk = scene.model.body(f"{name}/trunk").id
        assert scene.model.body_subtreemass[trunk] == pytest.approx(A1.mass)
        np.testing.assert_allclose(data.subtree_com[trunk], [0, lane, STANDING_HEIGHT], atol=5e-3)
        site = data.site(f"{name}/bar").xpos
        np.testing.assert_allclose(site - data.subtree_com[trunk], ATTACH, atol=5e-3)


@pytest.mark.parametrize("restrict", [(), ("yaw",), ("roll", "pitch", "yaw")])
@pytest.mark.parametrize("step", [0.0, 0.1])
def test_bars_fit_between_their_robots(restrict, step):
    team = BarTeam(robots=4, payload=2.0, payload_at=0.2, restrict=restrict)
    scene = build_bar_scene(team, Ground(step=step))
    data = scene.data()
    for index in range(3):
        left, right = (data.site(f"{name}/bar").xpos for name in team.names[index : index + 2])
        assert np.linalg.norm(left - right) == pytest.approx(1.0, abs=1e-9)
    connects = [c for c in range(data.nefc) if data.efc_type[c] == 0]
    assert np.abs(data.efc_pos[connects]).max() < 1e-9


@pytest.mark.parametrize("restrict", [(), ("yaw",), ("roll", "yaw"), ("roll", "pitch", "yaw")])
@pytest.mark.parametrize("step", [0.0, 0.1])
def test_bars_turn_about_the_axes_that_are_free(restrict, step):
    """Of all motions that the joints allow, over the robots' axes, which are the world's."""
    scene = build_bar_scene(BarTeam(robots=3, restrict=restrict), Ground(step=step))
    model, data = scene.model, scene.data()
    rows = np.zeros((data.ne, model.nv))
    for row, unit in zip(rows, np.eye(data.nefc), strict=False):
        mujoco.mj_mulJacTVec(model, data, row, unit)
    _, sizes, directions = np.linalg.svd(rows)
    motions = directions[np.count_nonzero(sizes > 1e-9) :].T
    for index in range(2):
        turn = {}
        for body in (f"bar{index + 1}", *(f"{name}/trunk" for name in scene.team.names)):
            turn[body] = np.zeros((3, model.nv))
            mujoco.mj_jacBody(model, data, None, turn[body], model.body(body).id)
        for name in scene.team.names[index : index + 2]:
            relative = (turn[f"bar{index + 1}"] - turn[f"{name}/trunk"]) @ motions
            for axis, how_far in zip(AXES, np.linalg.norm(relative, axis=1), strict=True):
                assert how_far < 1e-9 if axis in restrict else how_far > 0.1, axis


def test_the_load_sits_where_it_is_told():
    scene = build_bar_scene(BarTeam(payload=4.0, payload_at=0.25, bar_mass=1e-3), Ground())
    data = scene.data()
    bar = scene.model.body("bar1").id
    np.testing.assert_allclose(data.xipos[bar][1], 0.25, atol=1e-3)
    assert scene.model.body_mass[bar] == pytest.approx(4.001)


@pytest.mark.parametrize("kind", ["rough", "blocks"])
def test_rough_ground_follows_its_seed_and_starts_flat(kind):
    def surface(seed: int) -> np.ndarray:
        model = build_bar_scene(BarTeam(), Ground(kind, height=0.08, seed=seed)).model
        return np.concatenate([model.hfield_data, model.geom_pos.ravel(), model.geom_size.ravel()])

    np.testing.assert_array_equal(surface(3), surface(3))
    assert not np.array_equal(surface(3), surface(4))
    scene = build_bar_scene(BarTeam(), Ground(kind, height=0.08, seed=3))
    data = scene.data()
    heights = []
    for x in np.linspace(-0.5, 8.0, 200):
        start, down = np.array([x, 0.8, 1.0]), np.array([0.0, 0.0, -1.0])
        groups = np.array([1, 0, 0, 0, 0, 0], np.uint8)
        geom = np.zeros(1, np.int32)
        heights.append(1.0 - mujoco.mj_ray(scene.model, data, start, down, groups, 1, -1, geom))
    assert np.abs(heights[:10]).max() < 1e-6
    assert 0.04 < max(heights) <= 0.08 + 1e-6
    assert min(heights) > -1e-6


def test_the_team_walks_as_told(walk):
    figures = outcome(walk)
    assert figures["completed"], figures["fall"]
    assert figures["velocity_error_m_s"]["rms"] < 0.06
    assert 0.6 < figures["distance_m"] < 0.9
    assert figures["fallbacks"] == figures["control_fallbacks"] == 0


def test_invariants_hold_on_the_way(walk):
    extremes = walk.extremes
    assert 0 < extremes["bar_length_error_m"] < 1e-3
    assert extremes["torque_fraction"] <= 1.0
    height = walk.bodies[:, :, 2]
    assert (np.abs(height - STANDING_HEIGHT) < 0.05).all()
    upright = quaternions.matrix(walk.bodies[..., 3:7])[..., 2, 2]
    assert (upright > np.cos(0.1)).all()
    weight = 9.81 * (2 * A1.mass + 5.3)
    settled = walk.time > 0.5
    assert walk.more["foot_force"][settled].sum(axis=(1, 2))[:, 2].mean() == pytest.approx(
        weight, rel=0.03
    )


def test_planned_forces_keep_to_the_pyramid_and_to_standing_feet(walk):
    force, contact = walk.force, walk.contact > 0.5
    assert np.abs(force[~contact]).max() == 0.0
    limit = 0.6 / math.sqrt(2) * force[..., 2]
    assert (np.abs(force[..., :2]).max(axis=-1) <= limit + 1e-3).all()


@pytest.mark.bindings
def test_runs_repeat_themselves():
    def walk(sensors: Sensors, seed: int = 2):
        scenario = BarScenario(duration=0.7, sensors=sensors, seed=seed)
        return run_scenario(scenario)

    first, second = walk(Sensors.usual()), walk(Sensors.usual())
    np.testing.assert_array_equal(first.more["qpos"], second.more["qpos"])
    # There is noise, another one for each robot and seed, and it finds its way into the motion.
    exact, other = walk(Sensors()), walk(Sensors.usual(), seed=3)
    np.testing.assert_array_equal(first.more["qpos"][0], exact.more["qpos"][0])
    noise = first.bodies[0] - exact.bodies[0]
    assert (np.abs(noise).max(axis=1) > 1e-3).all()
    assert np.abs(noise[0] - noise[1]).max() > 1e-3
    assert np.abs(first.more["qpos"][-1] - exact.more["qpos"][-1]).max() > 1e-4
    start = first.more["qpos"][0, 0] - other.more["qpos"][0, 0]
    assert np.abs(first.more["qpos"][:, 0] - other.more["qpos"][:, 0] - start).max() > 1e-4


@pytest.mark.bindings
def test_a_fall_ends_the_run_and_says_why():
    push = Force.constant(0, (0.0, 900.0, 0.0), 0.1, 0.6)
    scenario = BarScenario(forces=(push,), duration=3.0)
    result = run_scenario(scenario)
    figures = outcome(result)
    assert figures["fell"]
    assert not figures["completed"]
    assert "touched the ground" in result.fall or "tipped over" in result.fall
    assert 0.1 < figures["fall"]["time_s"] < 2.0


def test_forces_act_as_described():
    force = Force(0, (10.0, 20.0, 30.0), start=2.0, end=5.0).on(1)
    np.testing.assert_allclose(force.force(2.1), np.array([10, 20, 30]) * np.sin(
        2 * np.pi * 0.1 / np.array([1.0, 0.7, 0.4])))  # fmt: skip
    np.testing.assert_array_equal(force.force(1.9), np.zeros(3))
    steady = Force.constant(0, (1.0, 2.0, 3.0), 1.0, 4.0).on(1)
    np.testing.assert_allclose(steady.force(3.0), [1, 2, 3])


@pytest.mark.bindings
def test_a_rope_pulls_once_it_is_taut():
    """Held in place, a robot that stands is dragged towards the anchor."""
    rope = Rope(0, anchor=(1.2, 0.5, 0.3), velocity=(0.5, 0.0, 0.0), slack=1.2, start=0.1)
    moves = []
    for forces in ((), (rope,)):
        scenario = BarScenario(velocity=Velocity(), forces=forces, duration=0.6)
        moves.append(run_scenario(scenario).bodies[-1, 0, 0])
    assert moves[1] > moves[0] + 1e-3


def test_commands_can_change_under_way():
    scenario = BarScenario(duration=5.0)

    class Told:
        def at(self, time, pose, period):
            return Orders((Velocity(0.2), Velocity(0.0, 0.1)))

    loop = loop_of(scenario, director=Told())
    told = next(loop.ticks()).plan.reference[:, 7:9]
    np.testing.assert_allclose(told, [[0.2, 0.0], [0.0, 0.1]])


def test_texts_are_read():
    assert texts.parse_payload("5") == (5.0, 0.5)
    assert texts.parse_payload("2.5@0.1") == (2.5, 0.1)
    assert texts.parse_ground("rough:0.12", seed=3) == Ground("rough", 0.12, seed=3)
    assert texts.parse_velocities("0.15/0") == (Velocity(0.15), Velocity(0.0))
    assert texts.parse_velocities("0.3,0,0.2") == (Velocity(0.3, 0.0, 0.2),)
    sinusoids = texts.parse_force("sin:20", 3)
    assert [force.robot for force in sinusoids] == [0, 1, 2]
    assert sinusoids[0].amplitude == (20.0, 20.0, 20.0)
    (push,) = texts.parse_force("push:0,80,0@3,3.2:1", 2)
    assert (push.robot, push.start, push.end) == (1, 3.0, 3.2)
    (rope,) = texts.parse_force("pull:0,-0.3@2,8", 2)
    assert rope.velocity == (0.0, -0.3, 0.0)
    pressing = texts.parse_force("opposed:30", 2)
    assert [force.amplitude[1] for force in pressing] == [-30.0, 30.0]


@pytest.mark.parametrize(
    ("parse", "text", "message"),
    [
        (texts.parse_payload, "heavy", "'heavy' is no finite number"),
        (texts.parse_payload, "nan", "no finite number"),
        (texts.parse_ground, "lava", "flat, rough, blocks"),
        (texts.parse_ground, "rough:9", r"ground.height: 9.0"),
        (texts.parse_velocities, "0.1,0,0,0", "VX"),
        (lambda t: texts.parse_force(t, 2), "wind:3", "must begin with sin"),
        (lambda t: texts.parse_force(t, 2), "push:1,2,3", "VALUES@FROM,TO"),
        (lambda t: texts.parse_force(t, 2), "push:1,2,3@0,1:7", "robot 7"),
        (lambda t: texts.parse_force(t, 2), "push:1,2@0,1", "three numbers"),
        (lambda t: texts.parse_force(t, 2), "push:1,2,3@5,1", "in order"),
        (lambda t: texts.parse_force(t, 2), "pull:0,0@0,1", "other than 0"),
    ],
)
def test_garbage_is_explained(parse, text, message):
    with pytest.raises(InputError, match=message):
        parse(text)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: BarTeam(robots=1), "robots: 1"),
        (lambda: BarTeam(payload=-1.0), "payload: -1.0"),
        (lambda: BarTeam(restrict=("pitch", "pitch")), "restrict"),
        (lambda: Ground(friction=0.0), "ground.friction: 0.0"),
        (lambda: BarScenario(planner="wizard"), "planner: 'wizard'"),
        (lambda: BarScenario(velocity=Velocity(9.0)), "velocity"),
        (lambda: BarScenario(velocities=(Velocity(),)), "velocities: 1 for 2"),
        (lambda: BarScenario(duration=0.0), "duration: 0.0"),
        (lambda: BarScenario(sensors=Sensors(rate=-1.0)), "sensors: rate"),
        (lambda: BarScenario(sensors=Sensors(delay=5.0)), "delay is 5000"),
        (
            lambda: BarScenario(sensors=Sensors(delay=0.0014)),
            "delay: 0.0014 s must be whole",
        ),
        (
            lambda: BarScenario(sensors=Sensors(rate="fast")),
            "rate: 'fast' must be a number",
        ),
        (lambda: BarScenario(sensors=Sensors(rate=math.nan)), "sensors: rate is nan"),
        (lambda: BarScenario(duration=1e-4), "duration: 0.0001 s must be from 0.001 to 600"),
        (lambda: BarScenario(duration=math.nan), "duration: nan s must be from"),
        (lambda: BarScenario(seed=-1), "seed: -1 must be from 0 to 2147483647"),
        (lambda: BarScenario(seed=2**31), "seed: 2147483648 must be from"),
        (lambda: BarTeam(robots=2.5), "robots: 2.5 must be from 2 to 6, an integer"),
        (lambda: BarTeam(robots=None), "robots: None must be from"),
        (lambda: BarTeam(length=math.inf), "bar length: inf m"),
        (lambda: Ground(height=None), "ground.height: None must be from"),
        (lambda: Ground(softness=math.nan), "ground.softness: nan s"),
        (lambda: Force.constant(0, (1e9, 0, 0)), "force.amplitude: 1000000000.0 N must be from"),
        (lambda: Rope(0, (0, 0, 0), start=2.0, end=1.0), "rope: from 2.0 to 1.0 s"),
    ],
)
def test_bad_scenarios_are_explained(make, message):
    with pytest.raises(InputError, match=message):
        make()


@pytest.mark.parametrize("dt", [0.0004, 0.0015, 0.0123, 1e-10])
def test_a_planning_period_is_whole_physics_steps(dt):
    planner = BarScenario().build_planner(replace(PHYSICS, dt=dt))
    with pytest.raises(InputError, match=r"planner.dt: .* must be whole physics steps of 0.001 s"):
        run_scenario(BarScenario(), planner)


def test_a_planning_period_of_ten_steps_is_kept():
    scenario = BarScenario(duration=0.1)
    result = run_scenario(scenario, scenario.build_planner(replace(PHYSICS, dt=0.01)))
    np.testing.assert_allclose(np.diff(result.time), 0.01, atol=1e-9)
    assert result.duration == pytest.approx(0.1)


def test_the_shortest_run_has_one_plan():
    scenario = BarScenario(duration=1e-3)
    assert outcome(run_scenario(scenario))["completed"]


BACKWARDS = Velocity(-0.5)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"ground": Ground("rough"), "velocity": BACKWARDS}, "left is told to walk off its ground"),
        ({"ground": Ground("rough"), "duration": 40.0}, "off its ground after 28.7 s, at (13.8"),
        ({"ground": Ground("rough"), "velocity": Velocity(0.0, 0.3), "duration": 15.0}, "left is"),
        ({"ground": Ground("rough"), "duration": 40.0, "distance": 10.0}, None),
        ({"ground": Ground("rough"), "duration": 20.0, "velocity": Velocity(0.5, 0, 0.4)}, None),
        ({"ground": Ground(step=0.05), "velocity": BACKWARDS}, "left is told"),
        ({"ground": Ground(step=0.05), "velocity": Velocity(0, -0.2)}, "left is told"),
        ({"velocity": BACKWARDS, "duration": 60.0}, None),
        ({"ground": Ground("blocks"), "velocity": BACKWARDS}, None),
        ({"ground": Ground("rough"), "team": BarTeam(6, length=2.0)}, "after 0.0 s"),
    ],
)
def test_nobody_walks_off_the_height_field(changes, message):
    found = findings(BarScenario(**changes))
    assert [f.is_error for f in found] == [True] * len(found)
    assert bool(found) == (message is not None)
    assert message is None or message in found[0].message
