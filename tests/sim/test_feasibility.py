"""What cannot be is said in words; what can be is left alone."""

import pytest

from palanquin.sim.feasibility import findings
from palanquin.sim.feasibility.ground import longest_step
from palanquin.sim.feasibility.walking import longest_flight
from palanquin.sim.scenarios import SHIPPED, open_scenario
from palanquin.sim.scenarios.route import foothold_route, payload_route

TROT = open_scenario("trot")
LEFT, RIGHT = (dict(robot) for robot in TROT.robots)
RAMP = {"type": "ramp", "H": 1.6, "xg": 2.0}


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_scenarios_are_possible(name):
    assert [f for f in findings(open_scenario(name)) if f.is_error] == []


@pytest.mark.parametrize(
    ("changes", "path", "message"),
    [
        ({"duration": 0.001}, ("duration",), "has 0 periods"),
        (
            {"robots": [LEFT, {**RIGHT, "attach": [0.0, 0.55, 0.0]}]},
            ("robots", 1, "attach"),
            "overlap: 5.0 cm apart, where a hand takes 10 cm",
        ),
        (
            {"robots": [LEFT, {**RIGHT, "attach": [0.0, 0.4, 0.0]}]},
            ("robots", 1, "attach"),
            "right would stand in left",
        ),
        (
            {"payload": {"mass": 16.0, "height": 1.1}},
            ("robots", 0, "attach"),
            "the grasp of left is 1.10 m high, 29 cm out of its arm's reach of 0.4 m",
        ),
        (
            {"terrain": {**RAMP, "kappa": 0.9}},
            ("terrain",),
            "is 0.90 (42.0 degrees), over the friction limit",
        ),
        (
            {"robots": [LEFT, {**RIGHT, "gait": {"name": "pronk", "duty": 0.02}}]},
            ("robots", 1, "gait"),
            "gait 'pronk' has next to no stance: all feet are in the air for 0.46 of 0.47 s",
        ),
        (
            {"ditches": {"type": "lines", "lines": [{"a": 1, "b": 0, "c": -2, "d": 0.5}]}},
            ("ditches", "lines", 0, "d"),
            "a ditch of 50 cm is wider than a step: left reaches 48 cm",
        ),
        (
            {"ditches": {"type": "random", "widest": 0.6, "spacing": 1.0}},
            ("ditches", "widest"),
            "wider than a step",
        ),
    ],
)
def test_the_impossible_is_an_error(changes, path, message):
    errors = [f for f in findings(TROT.changed(**changes)) if f.is_error]
    assert any(f.path == path and message in f.message for f in errors), errors


@pytest.mark.parametrize(
    ("changes", "path", "message"),
    [
        ({"payload": {"mass": 60.0}}, ("payload", "mass"), "a DynaArm's motor has 40"),
        ({"payload": {"height": 0.6}}, ("payload", "height"), "would stand at 0.45 m"),
        ({"terrain": {**RAMP, "kappa": 0.8}}, ("terrain",), "at the friction limit"),
        (
            {"robots": [LEFT, {**RIGHT, "attach": [0.0, -1.4, 0.0]}]},
            ("robots", 1, "attach"),
            "40 cm outside the payload",
        ),
        (
            {"robots": [LEFT, {**RIGHT, "gait": {"name": "pronk", "period": 2.0}}]},
            ("robots", 1, "gait"),
            "all feet in the air for 0.80 s at a time: a jump 78 cm high",
        ),
        (
            {"command": {"type": "velocity", "steps": [{"vx": 3.0}]}},
            ("command",),
            "left moves 0.70 m while a foot stands",
        ),
    ],
)
def test_the_doubtful_is_a_warning(changes, path, message):
    found = findings(TROT.changed(**changes))
    assert not any(f.is_error for f in found)
    assert any(f.path == path and message in f.message for f in found), found


STAIRS, STONES, WALKWAY = (open_scenario(name) for name in ("stairs", "stones", "walkway"))


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_scenarios_raise_no_alarm(name):
    scenario = open_scenario(name)
    for seed in range(3):
        found = findings(scenario.changed(seed=seed))
        assert all("friction limit" in f.message and "ramp" in name for f in found), found


def told(**step):
    return {"command": {"type": "velocity", "steps": [step]}}


@pytest.mark.parametrize(
    ("scenario", "changes"),
    [
        *((s, {"duration": 30.0}) for s in (STAIRS, STONES, WALKWAY)),
        *((s, told(vx=1.0)) for s in (STAIRS, STONES, WALKWAY)),
        *((s, told(vx=-0.6)) for s in (STAIRS, STONES, WALKWAY)),
        *((s, told(vy=0.3)) for s in (STAIRS, STONES, WALKWAY)),
        (STAIRS, told(vx=0.4, wz=0.2)),
        (STAIRS, {"command": {"type": "waypoints", "through": [{"x": 1.0, "y": 3.0}]}}),
    ],
)
def test_nobody_walks_off_the_ground(scenario, changes):
    (error,) = [f for f in findings(scenario.changed(**changes)) if f.is_error]
    assert error.path == ("terrain",)
    assert "s the way leads off the ground: " in error.message


def test_to_the_edge_and_not_beyond():
    """The ground ends at 6.2 m, fore feet are 0.17 m behind the payload, legs reach 0.24 m."""
    assert findings(STAIRS.changed(duration=21.5)) == []
    assert findings(STAIRS.changed(duration=22.5)) != []


def test_the_edge_of_a_height_map_is_worth_a_word():
    flat = {"type": "height_map", "heights": [[0.0] * 3] * 3, "origin": [-2, -2], "spacing": 2}
    (doubt,) = findings(TROT.changed(terrain=flat))
    assert not doubt.is_error
    assert "after 5.5 s LF of left is off the height map" in doubt.message
    assert findings(TROT.changed(terrain=flat, duration=4.0)) == []


@pytest.mark.parametrize(
    ("scenario", "changes", "message"),
    [
        (
            TROT,
            {"ditches": {"type": "lines", "lines": [{"a": 1, "b": 0, "c": 0.2, "d": 0.3}]}},
            "LF of left begins at (-0.17, 0.73) m, in the ditch along 1 x + 0 y + 0.2 = 0",
        ),
        (WALKWAY, {"start_pose": {"x": 1.5, "y": 0.1}}, "3 cm beside the ground"),
        (STONES, {"start_pose": {"x": -4.0}}, "beside the ground"),
        (
            TROT,
            {"obstacles": [{"type": "cylinder", "centre": [-0.59, 0.73], "radius": 0.03}]},
            "LH of left begins at (-0.59, 0.73) m, in obstacles[0]",
        ),
    ],
)
def test_feet_begin_where_they_can_stand(scenario, changes, message):
    errors = [f for f in findings(scenario.changed(**changes)) if f.is_error]
    assert any(message in f.message for f in errors), errors


def planned(**settings):
    return {"planner": {**dict(TROT.planner), **settings}}


@pytest.mark.parametrize(
    ("settings", "is_error"),
    [
        ({"rate": 1.0}, True),
        ({"rate": 2.2}, True),
        ({"rate": 5.0}, False),
        ({"rate": 10.0, "horizon": 2}, None),
        ({"rate": 7.0}, None),
        ({"rate": 1.5, "horizon": 31}, False),
        ({"dt": 0.5}, True),
        ({"dt": 0.3}, False),
        ({"dt": 0.1}, None),
    ],
)
def test_plans_come_in_time(settings, is_error):
    found = findings(TROT.changed(**planned(**settings)))
    assert {f.is_error for f in found} == (set() if is_error is None else {is_error})
    assert all(f.path == ("planner", "dt" if "dt" in settings else "rate") for f in found)


def test_turning_robots_are_fast_too():
    found = findings(TROT.changed(**told(wz=3.0)))
    assert ["robot" not in f.message and "its legs reach" in f.message for f in found] == [True] * 2


def test_a_slope_that_nobody_walks_on_does_not_matter():
    assert findings(TROT.changed(terrain={**RAMP, "kappa": 0.9, "xg": 50.0})) == []


def test_the_route_follows_the_command():
    scenario = TROT.changed(
        command={"type": "waypoints", "through": [{"x": 1.0}, {"x": 1.0, "y": 0.5}], "speed": 0.25}
    )
    route = payload_route(scenario)
    assert route[-1] == pytest.approx([1.0, 0.5, 0.0])
    feet = foothold_route(scenario)
    # The Laikago's hips are 0.21 m around its centre, 0.38 m behind its hand.
    assert feet[:, 0].min() == pytest.approx(-0.38 - 0.21)
    assert feet[:, 0].max() == pytest.approx(1.0 - 0.38 + 0.21)
    assert feet[:, 1].max() == pytest.approx(0.6 + 0.13 + 0.5)


def test_the_longest_step_is_pythagoras():
    assert longest_step(TROT, TROT.robots[0]) == pytest.approx(2 * (0.4**2 - 0.32**2) ** 0.5)


def test_flights_are_as_long_as_the_gait_says():
    gaits = {name: TROT.robots[0].changed(gait=name).gait.gait for name in ("trot", "pronk")}
    assert longest_flight(gaits["trot"]) == 0.0
    assert longest_flight(gaits["pronk"]) == pytest.approx(0.4 * 14 / 30, abs=0.01)
