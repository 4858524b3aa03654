"""A payload in hands in full physics: what is carried, by whom, within what limits."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from palanquin.sim.runs.hands_physics import footholds, held_scene
from palanquin.sim.runs.physics_outcome import touchdowns
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import loop_of, run_scenario
from palanquin.sim.scenarios import open_scenario
from palanquin.sim.scenarios.physical import TROT_PERIOD, physical
from palanquin.sim.scenarios.team import Ditch

TROT = physical(open_scenario("trot"))
STANDING = {"type": "velocity", "steps": [{"vx": 0.0}]}


def standing(scenario=TROT, **fields):
    robots = [robot.changed(gait="stand") for robot in scenario.robots]
    return scenario.changed(robots=robots, command=STANDING, **fields)


def weight(scenario):
    model = held_scene(scenario).model
    return 9.81 * model.body_mass.sum()


@pytest.fixture(scope="module")
def trot():
    return run_scenario(TROT.changed(duration=3.0))


def test_a_team_trots_with_its_beam(trot):
    figures = outcome(trot)
    assert figures["completed"]
    assert trot.bodies[-1, 0, 0] == pytest.approx(0.4 * 3.0, abs=0.05)
    settled = trot.time > 1.5
    error = (trot.bodies - trot.references)[settled, 0, :3]
    assert np.sqrt((error**2).mean(axis=0)).max() < 1e-3
    assert figures["torque_fraction_max"] <= 1.0
    assert np.abs(trot.more["torque_share"]).max() <= 1.0
    assert figures["slip_m"] < 3e-3
    assert (figures["control_fallbacks"], figures["fallbacks"]) == (0, 0)
    assert figures["collisions"] == {"steps": 0, "first": None}


def test_the_ground_bears_all_of_the_weight(trot):
    cycle = round(TROT_PERIOD / trot.period)
    forces = trot.more["foot_force"][-2 * cycle :, :, :, 2].sum(axis=(1, 2))
    assert forces.mean() == pytest.approx(weight(TROT), rel=0.02)


def test_swinging_feet_are_in_the_air(trot):
    swings = trot.contact[100:] < 0.5
    forces = np.linalg.norm(trot.more["foot_force"][100:], axis=-1)
    assert np.median(forces[swings]) == 0
    assert np.median(forces[~swings]) > 50


def test_hands_stay_where_they_hold(trot):
    scene = held_scene(TROT)
    data = mujoco.MjData(scene.model)
    for qpos in trot.more["qpos"][::20]:
        data.qpos[:] = qpos
        mujoco.mj_kinematics(scene.model, data)
        for robot in scene.team.names:
            hand, hold = data.site(f"{robot}/hand"), data.site(f"hold/{robot}")
            assert np.linalg.norm(hand.xpos - hold.xpos) < 1e-3
            np.testing.assert_allclose(hand.xmat, hold.xmat, atol=0.02)


def test_a_seed_moves_bodies_from_the_start():
    scenario = TROT.changed(seed=5)
    plant = loop_of(scenario).plant
    state = scenario.start_state()
    measured = plant.measure().bodies
    np.testing.assert_allclose(measured[0], state.bodies[0], atol=1e-9)
    moving = [*range(3, 7), *range(10, 13)]  # trunks; the centre of mass is that of the pose
    np.testing.assert_allclose(measured[1:, moving], state.bodies[1:, moving], atol=1e-9)
    np.testing.assert_allclose(measured[1:, 7:10], state.bodies[1:, 7:10], atol=0.01)
    assert np.abs(measured[1:, 7:10]).max() > 0.03


def test_feet_below_the_load_bear_alike():
    def share_of_front_feet(feet_below):
        settings = {**dict(TROT.planner), "feet_below": feet_below}
        record = run_scenario(standing(duration=1.0, planner=settings))
        forces = record.more["foot_force"][-20:, :, :, 2].mean(axis=0)
        return forces[:, :2].sum() / forces.sum()

    assert share_of_front_feet("load") == pytest.approx(0.5, abs=0.03)
    assert share_of_front_feet("hips") > 0.7


def test_a_run_repeats_itself(trot):
    again = run_scenario(TROT.changed(duration=0.3))
    np.testing.assert_array_equal(again.x, trot.x[: len(again.x)])


def test_a_push_moves_them_and_is_withstood():
    push = {"body": "left", "force": [0, 100, 0], "start": 0.3, "duration": 0.4}
    record = run_scenario(standing(pushes=[push], duration=2.0))
    pushed = record.more["disturbance"][:, 1, 1]
    assert record.period * pushed.sum() == pytest.approx(40.0)  # N s
    y = record.bodies[:, 1, 1]
    assert 2e-3 < np.abs(y - y[0]).max() < 0.1
    assert outcome(record)["completed"]
    assert np.linalg.norm(record.bodies[-1, 0, :3] - record.references[-1, 0, :3]) < 0.02


def test_a_team_that_is_knocked_over_says_so():
    push = {"body": "left", "force": [0, 3000, 0], "start": 0.1, "duration": 0.5}
    record = run_scenario(standing(pushes=[push], duration=3.0))
    assert record.duration < 3.0
    assert "left" in record.fall or "payload" in record.fall or "right" in record.fall
    assert outcome(record)["fell"]


def test_gaits_change_for_planner_and_controllers_alike():
    changes = [{"time": 0.2, "gait": "stand", "at_once": True, "robots": ["right"]}]
    scenario = TROT.changed(gait_changes=changes, command=STANDING)
    loop = loop_of(scenario)
    for tick in loop.ticks():
        if tick.time > 0.6:
            break
    times = np.array([1.0, 1.1, 1.2, 1.3])
    planned = loop.planner.contacts(times)
    controlled = np.stack([loop.plant.simulation.contacts(i, times) for i in range(2)], axis=1)
    np.testing.assert_array_equal(planned, controlled)
    assert controlled[:, 1].all()
    assert not controlled[:, 0].all()


def test_a_trot_of_open_rhythm_is_quick_in_physics():
    changes = [{"time": 1.0, "gait": "crawl"}, {"time": 2.0, "gait": "trot"}]
    robots = [TROT.robots[0], TROT.robots[1].changed(gait={"name": "trot", "period": 0.5})]
    plain = open_scenario("trot").changed(gait_changes=changes)
    scenario = physical(plain)
    assert {robot.gait.gait.period for robot in scenario.robots} == {TROT_PERIOD}
    periods = [change.gait.gait.period for change in scenario.gait_changes]
    assert periods == [plain.gait_changes[0].gait.gait.period, TROT_PERIOD]
    told = physical(plain.changed(robots=robots))
    assert told.robots[1].gait.gait.period == 0.5
    assert physical(scenario) == scenario


def test_a_swinging_foot_is_told_where_the_plan_lands_it():
    scenario = TROT.changed(duration=0.2)
    tick = next(loop_of(scenario).ticks())
    landing = footholds(tick.plan, 0)
    stands = tick.plan.contacts[0, 0]
    assert np.isnan(landing[stands]).all()
    knot = int(np.argmax(tick.plan.contacts[:, 0, ~stands][:, 0]))
    foot = int(np.flatnonzero(~stands)[0])
    np.testing.assert_array_equal(landing[foot], tick.plan.feet[knot, 0, foot])


def test_no_foot_lands_in_a_ditch_however_often_is_planned():
    lines = [{"a": 1, "b": 0.1, "c": -c, "d": 0.2} for c in (0.5, 0.95)]
    ditches = {"type": "lines", "lines": lines}
    record = run_scenario(TROT.changed(ditches=ditches, duration=3.5))
    figures = outcome(record)
    assert figures["completed"]
    touched = figures["touchdowns"]
    assert touched["count"] > 50
    assert touched["in_ditches"] == 0


def test_touchdowns_in_ditches_are_counted():
    record = run_scenario(TROT.changed(duration=1.0))
    assert outcome(record)["touchdowns"]["in_ditches"] == 0
    feet = touchdowns(record)
    ditch = Ditch(1.0, 0.0, -float(feet[0, 0]), 0.02)
    record.team = replace(record.team, ditches=(ditch,))
    counted = outcome(record)["touchdowns"]
    assert counted["count"] == len(feet)
    assert counted["in_ditches"] == (np.abs(feet[:, 0] - feet[0, 0]) < 0.01).sum()
    assert counted["deepest_m"] == pytest.approx(0.01)
