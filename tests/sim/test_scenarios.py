"""Scenarios: the shipped ones, teams that fit their scene, starts that repeat, checked values."""

import numpy as np
import pytest
from pydantic import ValidationError

from palanquin.problems import terrains
from palanquin.problems.clm.references import nominal_state
from palanquin.problems.clm.team_plan import TeamState
from palanquin.sim.errors import InputError
from palanquin.sim.scenarios import (
    SHIPPED,
    Scenario,
    disturbed,
    find_file,
    open_scenario,
    with_robots,
)

RAMP = terrains.Ramp(height=1.6, slope=0.8, x=0.5)
TROT = open_scenario("trot")


@pytest.fixture
def nominal():
    return TeamState(*nominal_state(TROT.team, RAMP, np.zeros(3)))


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_scenarios_are_valid(name):
    scenario = open_scenario(name)
    assert scenario.name == name
    assert scenario.summary
    assert scenario.team.robots == [robot.name for robot in scenario.scene.robots]


@pytest.mark.parametrize("name", SHIPPED)
def test_a_scenario_survives_json(name):
    scenario = open_scenario(name)
    assert Scenario.model_validate_json(scenario.model_dump_json()) == scenario


@pytest.mark.parametrize("robots", [1, 2, 3, 4])
def test_planner_and_scene_agree_on_the_team(robots):
    scenario = with_robots(TROT, robots)
    planned, drawn = scenario.team, scenario.scene
    assert planned.robots == [robot.name for robot in drawn.robots]
    assert [c.attach for c in planned.carriers] == [robot.attach for robot in drawn.robots]
    assert planned.payload.mass == drawn.payload.mass
    assert all(abs(robot.attach[1]) < drawn.payload.size[1] / 2 for robot in drawn.robots)
    np.testing.assert_allclose(planned.attach().mean(axis=0), 0.0, atol=1e-15)


def test_seed_zero_is_nominal(nominal):
    assert disturbed(nominal, RAMP, 0) is nominal


def test_a_seed_gives_the_same_start_again(nominal):
    first, again, other = (disturbed(nominal, RAMP, seed) for seed in (7, 7, 8))
    np.testing.assert_array_equal(first.bodies, again.bodies)
    np.testing.assert_array_equal(first.feet, again.feet)
    assert np.abs(first.bodies - other.bodies).max() > 1e-3


def test_disturbed_starts_are_near_and_on_the_ground(nominal):
    before = nominal.bodies.copy()
    state = disturbed(nominal, RAMP, 1)
    moved = state.bodies - before
    np.testing.assert_array_equal(nominal.bodies, before)
    assert 0 < np.abs(moved[:, :3]).max() <= 0.02
    assert 0 < np.abs(moved[:, 7:10]).max() <= 0.05
    np.testing.assert_allclose(np.linalg.norm(state.bodies[:, 3:7], axis=1), 1.0)
    ground = RAMP.height(state.feet[..., 0], state.feet[..., 1])
    np.testing.assert_allclose(state.feet[..., 2], ground)


def test_negative_seeds_are_refused(nominal):
    with pytest.raises(InputError, match="seed: -1 must be at least 0"):
        disturbed(nominal, RAMP, -1)


def test_random_ditches_repeat_and_keep_their_distance():
    scenario = open_scenario("ditch")
    lines = np.array(scenario.ditches.draw(3))
    np.testing.assert_array_equal(lines, scenario.ditches.draw(3))
    assert np.abs(lines - scenario.ditches.draw(4)).max() > 1e-3
    assert lines.shape == (12, 4)
    centre, width = -lines[:, 2], lines[:, 3]
    assert (width >= 0.05).all()
    assert (width <= 0.32).all()
    ground = np.diff(centre) - (width[1:] + width[:-1]) / 2
    assert (ground >= scenario.ditches.ground - 1e-12).all()
    drawn = scenario.changed(seed=3).scene.ditches
    np.testing.assert_array_equal(lines, [(d.a, d.b, d.c, d.d) for d in drawn])


@pytest.mark.parametrize(
    ("shape", "moments"),
    [
        ({"type": "box", "size": [0.2, 1.0, 0.4]}, (1.16 / 12, 0.2 / 12, 1.04 / 12)),
        ({"type": "cylinder", "radius": 0.2, "length": 3.0}, (0.76, 0.02, 0.76)),
        ({"type": "cylinder", "radius": 0.2, "length": 3.0, "axis": "x"}, (0.02, 0.76, 0.76)),
    ],
)
def test_a_payload_has_its_shapes_inertia_unless_told(shape, moments):
    scenario = TROT.changed(payload={"mass": 1.0, "shape": shape})
    np.testing.assert_allclose(scenario.team.payload.inertia, moments)


def test_a_scene_gives_the_payload_the_inertia_of_its_shape():
    from palanquin.sim.scenes.scene import build_scene

    shape = {"type": "cylinder", "radius": 0.05, "length": 2.0, "axis": "x"}
    scenario = TROT.changed(payload={"mass": 3.0, "shape": shape})
    model = build_scene(scenario.scene).model
    body = model.body("payload")
    assert body.mass[0] == pytest.approx(3.0)
    np.testing.assert_allclose(sorted(body.inertia), sorted(scenario.payload.moments), rtol=1e-6)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"robots": []}, r"robots: .* at least 1 item"),
        ({"robots": TROT.robots * 3}, r"robots: .* at most 4 items"),
        ({"robots": TROT.robots[:1] * 2}, r"names \['left', 'left'\] must differ"),
        ({"gait_changes": [{"time": 1, "gait": "pace", "robots": ["x"]}]}, "'x' is not one of"),
        ({"pushes": [{"body": "x", "force": [1, 0, 0], "start": 1, "duration": 1}]}, "'x' is not"),
        ({"pushes": [{"body": "left", "start": 1, "duration": 1}]}, "one of them must push"),
        ({"gait_changes": [{"time": 1, "gait": "hop"}]}, "gait 'hop' is unknown; there are stand"),
        ({"gait_changes": [{"time": 1, "gait": "stand"}]}, "at 1 s the velocity must be 0"),
        ({"gait_changes": [{"time": 1, "gait": {"name": "trot", "duty": 0}}]}, "ever stand"),
        ({"payload": {"inertia": [1.6, 24, 1.6]}}, "24 is more than the other two together, 3.2"),
        ({"planner": {"horizon": 201}}, "planner.horizon: is 201"),
        ({"planner": {"dt": 0.0}}, "planner.dt: is 0.0"),
        ({"planner": {"qp": "magic"}}, "'magic'; there are"),
        ({"planner": {"penalties": {"leq": {"stiffness": 1}}}}, "unknown family leq; there are"),
        ({"planner": {"weights": {"force": [1, -1, 1]}}}, "no entry may be negative"),
        ({"duration": -1.0}, "duration: is -1.0"),
        ({"command": {"type": "velocity", "steps": [{"time": 1}, {"time": 1}]}}, "after the one"),
        ({"command": {"type": "teleport"}}, "type 'teleport' is unknown; there are velocity"),
        ({"ditches": {"type": "random", "widest": 0.5}}, "spacing 0.5 has no room"),
        ({"ditches": {"type": "lines", "lines": [{"a": 0, "b": 0, "c": 1, "d": 1}]}}, "direction"),
        ({"terrain": {"type": "stones", "length": 1e9}}, "hold 4.17e.10 stones; at most 5000"),
        ({"duration": "10"}, "duration: is '10'; input should be a valid number"),
        ({"colour": "red"}, "unknown key 'colour'; valid keys are name, summary, robots"),
    ],
)
def test_bad_scenarios_are_refused(changes, message):
    with pytest.raises(InputError, match=message):
        TROT.changed(**changes)


def test_a_bad_robot_names_the_model():
    with pytest.raises(ValidationError, match="'spot' is not known; known are a1, aliengo"):
        TROT.robots[0].changed(model="spot")


def test_tracking_that_is_not_there_is_refused():
    with pytest.raises(InputError, match=r"tracking: is 'hope'; .*'physics' or 'kinematic'"):
        TROT.changed(tracking="hope")


def test_unknown_names_are_refused():
    with pytest.raises(InputError, match="scenario: 'fly' is not known; known are"):
        find_file("fly")
