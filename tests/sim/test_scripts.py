"""What befalls a team under way: gait changes, pushes, waypoints, mixed robots and arms."""

import numpy as np
import pytest

from palanquin.sim.runs.loop import take_orders
from palanquin.sim.runs.nominal import nominal_step
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import open_scenario
from palanquin.sim.scenarios.command import WaypointCommand
from palanquin.sim.scenarios.disturbance import Push, mean_wrenches

TROT = open_scenario("trot")
STILL = {"type": "velocity", "steps": [{}]}
PERIOD = TROT.planner.period


def completed(rollout, scenario):
    return outcome(rollout)["completed"]


def push(**fields):
    return {"body": "left", "force": [0.0, 164.0, 0.0], "start": 0.5, "duration": 0.8} | fields


def test_a_push_hands_over_its_whole_impulse():
    wrenches = mean_wrenches(
        [Push(body="left", force=(3.0, 0, 0), torque=(0, 0, 2.0), start=0.05, duration=0.13)],
        ["payload", "left"],
        np.arange(10) * 0.04,
        0.04,
    )
    np.testing.assert_allclose(0.04 * wrenches[:, 1].sum(axis=0), [0.39, 0, 0, 0, 0, 0.26])
    np.testing.assert_array_equal(wrenches[:, 0], 0.0)
    assert wrenches[1, 1, 0] == pytest.approx(3.0 * 0.03 / 0.04)  # begins within the interval
    np.testing.assert_array_equal(wrenches[5:], 0.0)


def test_a_push_moves_the_model_as_newton_says():
    scenario = TROT.changed(command=STILL)
    planner = scenario.build_planner()
    state = planner.nominal_state()
    plan = planner.settle(0.0, state, scenario.command.at(0.0))
    wrench = np.zeros((3, 6))
    wrench[1] = [0.0, 164.0, 0.0, 0.0, 0.0, 5.0]
    still = nominal_step(planner, plan, state, PERIOD)
    pushed = nominal_step(planner, plan, state, PERIOD, wrench)
    body = scenario.robots[0].body
    change = pushed - still
    assert change[1, 8] == pytest.approx(164.0 / body.mass * PERIOD)
    assert change[1, 12] == pytest.approx(5.0 / body.inertia[2] * PERIOD, rel=1e-6)
    np.testing.assert_array_equal(change[[0, 2]], 0.0)


@pytest.mark.parametrize("known", [False, True])
def test_a_pushed_team_holds_its_payload(known):
    scenario = TROT.changed(command=STILL, pushes=[push(known=known)], duration=2.5)
    rollout = run_scenario(scenario)
    assert completed(rollout, scenario)
    bodies = rollout.x.reshape(len(rollout.time), -1, 13)
    np.testing.assert_allclose(
        PERIOD * rollout.more["disturbance"][..., 1].sum(axis=0), [0, 131.2, 0]
    )
    moved = np.abs(bodies[..., 1] - bodies[0, :, 1]).max(axis=0)
    assert moved[0] < 0.05
    # Who knows of a push stands against it from its first moment on.
    assert moved[1] < 5e-3 if known else moved[1] > 2e-2


def test_a_known_push_stands_in_the_plan_while_it_lasts():
    scenario = TROT.changed(command=STILL, pushes=[push(known=True)])
    planner = scenario.build_planner()
    orders = scenario.script().at(0.4, planner.reference_at(0.4), PERIOD)
    take_orders(planner, orders, 0.4, scenario.scene)
    assert orders.pushes == scenario.pushes
    force = planner.params["left.external_force"][:, 1]
    late = 0.4 + planner.dt * np.arange(planner.horizon + 1) >= 0.5 - 1e-9
    np.testing.assert_allclose(force, np.where(late, 164.0, 0.0), atol=1e-9)
    np.testing.assert_array_equal(planner.params["right.external_force"], 0.0)


def test_gaits_change_under_way_at_the_end_of_a_cycle():
    changes = [
        {"time": 0.5, "gait": "pace"},
        {"time": 1.5, "gait": "crawl", "robots": ["right"]},
    ]
    scenario = TROT.changed(gait_changes=changes, duration=3.5, command=TROT.command)
    rollout = run_scenario(scenario)
    assert completed(rollout, scenario)
    contact = rollout.contact > 0.5
    pairs = {"trot": [0, 1, 1, 0], "pace": [0, 1, 0, 1]}

    def matches(name, robot, start, end):
        at = (rollout.time >= start - 1e-9) & (rollout.time < end - 1e-9)
        flags = contact[at, robot]
        pair = np.array(pairs[name])
        return all(len(set(row[pair == side])) == 1 for row in flags for side in (0, 1))

    cycle = 14 / 30
    assert matches("trot", 0, 0.0, 2 * cycle)
    assert not matches("pace", 0, 0.0, 2 * cycle)
    assert matches("pace", 0, 2 * cycle, 3.5)
    assert matches("pace", 1, 2 * cycle, 4 * cycle)
    # A crawl has at least three feet on the ground.
    assert contact[rollout.time >= 4 * cycle, 1].sum(axis=-1).min() == 3


def test_the_payload_passes_through_its_waypoints():
    through = [{"x": 0.6}, {"x": 0.6, "y": 0.3, "yaw": 0.3, "hold": 0.5}, {"x": 0.3, "speed": 0.4}]
    scenario = TROT.changed(
        command={"type": "waypoints", "through": through, "speed": 0.3}, duration=6.5
    )
    rollout = run_scenario(scenario)
    assert completed(rollout, scenario)
    xy = rollout.x[:, :2]
    speed = np.linalg.norm(np.diff(xy, axis=0), axis=1) / PERIOD
    for waypoint in through:
        target = [waypoint.get("x", 0.0), waypoint.get("y", 0.0)]
        assert np.linalg.norm(xy - target, axis=1).min() < 0.01
    yaw = 2 * np.arctan2(rollout.x[:, 6], rollout.x[:, 3])
    assert yaw.max() == pytest.approx(0.3, abs=0.01)
    # 2 s for the first 0.6 m, 1 s for the turn, half a second of rest, and 1.06 s back.
    assert speed[20] == pytest.approx(0.3, abs=0.02)
    assert speed[-1] < 0.01
    resting = (rollout.time > 3.3) & (rollout.time < 3.45)
    assert speed[resting[:-1]].max() < 0.1


def test_a_follower_lands_on_each_pose_and_turns_no_faster_than_allowed():
    command = WaypointCommand.model_validate(
        {
            "type": "waypoints",
            "through": [{"x": 0.1, "yaw": 1.0}, {"x": 0.2, "y": -0.1}],
            "speed": 0.5,
            "turn_rate": 0.4,
        }
    )
    follower, pose, visited = command.start(), np.zeros(3), []
    for tick in range(400):
        velocity = follower.velocity(tick * 0.01, pose, 0.01)
        assert abs(velocity.wz) <= 0.4 + 1e-12
        assert np.hypot(velocity.vx, velocity.vy) <= 0.5 + 1e-12
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        pose = pose + 0.01 * np.array(
            [cos * velocity.vx - sin * velocity.vy, sin * velocity.vx + cos * velocity.vy,
             velocity.wz]
        )  # fmt: skip
        visited.append(pose)
    visited = np.array(visited)
    assert np.abs(visited - [0.1, 0.0, 1.0]).max(axis=1).min() < 1e-3
    np.testing.assert_allclose(pose, [0.2, -0.1, 1.0], atol=1e-3)


@pytest.mark.parametrize(
    ("yaw", "wanted", "turn"),
    [
        (3.1, -3.1, 0.083),
        (-3.1, 3.1, -0.083),
        (0.0, 3.0, 3.0),
        (0.2, -6.0, 0.083),
        (100.0, 100.5, 0.5),
        (1.0, 1.0 + 4 * np.pi, 0.0),
    ],
)
def test_a_follower_turns_the_shorter_way(yaw, wanted, turn):
    command = WaypointCommand.model_validate(
        {"type": "waypoints", "through": [{"x": 1.0, "yaw": wanted}], "turn_rate": 10.0}
    )
    follower, pose, turned = command.start(), np.array([0.0, 0.0, yaw]), 0.0
    for tick in range(400):
        velocity = follower.velocity(tick * 0.01, pose, 0.01)
        turned += 0.01 * velocity.wz
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        pose = pose + 0.01 * np.array(
            [cos * velocity.vx - sin * velocity.vy, sin * velocity.vx + cos * velocity.vy,
             velocity.wz]
        )  # fmt: skip
    assert turned == pytest.approx(turn, abs=1e-3)
    np.testing.assert_allclose(pose[:2], [1.0, 0.0], atol=1e-3)


@pytest.mark.parametrize("arm", ["massless", "dynaarm"])
def test_mixed_robots_with_either_arm_walk(arm):
    base = open_scenario("team3")
    scenario = base.changed(
        robots=[{**dict(robot), "arm": arm} for robot in base.robots], duration=1.0
    )
    rollout = run_scenario(scenario)
    assert completed(rollout, scenario)
    result = outcome(rollout)
    assert result["payload_position_error_m"]["max"] < 0.02
    assert max(result["violation"].values()) < 1e-2
    masses = [robot.body.mass for robot in scenario.scene.robots]
    assert masses == [robot.body.mass for robot in scenario.robots]
    # All forces together carry the weight.
    weight = 9.81 * (scenario.payload.mass + sum(masses))
    assert rollout.force[..., 2].sum(axis=(1, 2)).mean() == pytest.approx(weight, rel=0.02)
