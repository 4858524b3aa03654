"""Files of runs on bars: what they hold, what is wrong with one, what the command line changes."""

import json

import pytest
from typer.testing import CliRunner

from palanquin.cli import app
from palanquin.cli.demo_overrides import bars_overridden, overridden
from palanquin.problems.planning import Velocity
from palanquin.sim.errors import InputError
from palanquin.sim.feasibility import findings
from palanquin.sim.scenarios import (
    BARS,
    BarScenario,
    ScenarioError,
    ScenarioFile,
    open_any,
    open_scenario,
    schemas,
)
from palanquin.sim.scenarios.bar_forces import Force
from palanquin.sim.scenarios.bar_ground import Ground
from palanquin.sim.scenarios.bar_team import BarTeam
from palanquin.sim.scenarios.sensors import Sensors


@pytest.fixture
def read(tmp_path):
    def scenario(text):
        path = tmp_path / "mine.yaml"
        path.write_text("carry: bars\n" + text)
        return ScenarioFile(path).scenario()

    return scenario


@pytest.mark.parametrize("name", BARS)
def test_shipped_runs_are_valid_and_can_be(name):
    scenario = open_any(name)
    assert isinstance(scenario, BarScenario)
    assert scenario.name == name
    assert scenario.summary
    assert findings(scenario) == []


def test_a_file_sets_every_field(read):
    scenario = read("""
name: all
summary: Everything.
team: {robots: 3, length: 1.2, bar_mass: 0.4, payload: 2, payload_at: 0.3, restrict: [yaw]}
ground: {kind: rough, height: 0.04, friction: 0.5, step: 0.02, softness: 0.01, seed: 4}
planner: distributed
velocity: {vx: 0.1, vy: 0.05, wz: 0.2}
velocities: [{vx: 0.1}, {vx: 0.2}, {vx: 0.3}]
forces: ["push:0,60,0@3,3.5:2", {robot: 1, amplitude: [1, 2, 3]}]
sensors: {position: 1e-3, delay: 0.002}
friction: 0.4
duration: 5
distance: 2
seed: 7
""")
    push = Force.constant(2, (0.0, 60.0, 0.0), 3.0, 3.5)
    assert scenario == BarScenario(
        team=BarTeam(3, 1.2, 0.4, 2.0, 0.3, ("yaw",)),
        ground=Ground("rough", 0.04, 0.5, 0.02, 0.01, 4),
        planner="distributed",
        velocity=Velocity(0.1, 0.05, 0.2),
        velocities=(Velocity(0.1), Velocity(0.2), Velocity(0.3)),
        forces=(push, Force(1, (1.0, 2.0, 3.0))),
        sensors=Sensors(position=1e-3, delay=0.002),
        friction=0.4,
        duration=5.0,
        distance=2.0,
        seed=7,
        name="all",
        summary="Everything.",
    )


def test_a_file_is_named_by_its_own_name(read):
    assert read("").name == "mine"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("team: {robots: 1}", ":2: team.robots: 1 must be from 2 to 6"),
        ("team: {robots: two}", ":2: team.robots: is 'two'"),
        ("ground:\n  friction: 9", ":3: ground.friction: 9.0 must be from"),
        ("ground:\n  kind: lava", ":3: ground.kind: is 'lava'"),
        ("seed: 1\ncolour: red", "unknown key 'colour'; valid keys are team, ground"),
        ("team: {weight: 1}", ":2: team: unknown key 'weight'; valid keys are robots, length"),
        ("velocity: {vz: 1}", ":2: velocity: unknown key 'vz'; valid keys are vx, vy, wz"),
        ("forces: ['wind:3']", ":2: forces: 'wind:3' must begin with sin"),
        ("forces: [{robot: 2, amplitude: [1, 2, 3]}]", ":2: forces: robot 2 is none of 0 to 1"),
        ("duration: .nan", ":2: duration: nan s must be from"),
        ("velocities: [{vx: 1}]", ":2: velocities: 1 for 2 robots"),
        ("sensors: {delay: 0.0014}", ":2: sensors.delay: 0.0014 s must be whole"),
        ("planner: oracle", ":2: planner: is 'oracle'"),
        ("seed: 1.5", ":2: seed: is 1.5"),
        ("duration: '5'", ":2: duration: is '5'"),
    ],
)
def test_what_is_wrong_is_told_by_line(read, text, message):
    with pytest.raises(ScenarioError) as error:
        read(text)
    assert message in str(error.value)


def test_what_carries_is_hands_or_bars(tmp_path):
    path = tmp_path / "boats.yaml"
    path.write_text("carry: boats\n")
    with pytest.raises(ScenarioError, match=r":1: carry: is 'boats'; it must be hands or bars"):
        ScenarioFile(path).scenario()
    path.write_text("carry: bars\n")
    with pytest.raises(InputError, match="only runs of carrying hands"):
        open_scenario(str(path))


def test_schemas_are_json():
    for carry, schema in schemas().items():
        assert schema["properties"]["carry"]["const"] == carry
        json.dumps(schema, allow_nan=False)


def test_options_override_fields():
    rough = open_any("bar-rough")
    changed = bars_overridden(
        rough, robots=3, payload="2@0.3", restrict="yaw,roll", friction=0.4, velocity="0.1/0/0.1",
        noise=1.0, delay=0.003, planner="distributed", forces=["opposed:30"], seed=5, duration=2.0,
    )  # fmt: skip
    assert changed.team == BarTeam(3, payload=2.0, payload_at=0.3, restrict=("yaw", "roll"))
    assert changed.ground == Ground("rough", 0.05, friction=0.4, seed=5)
    assert [v.vx for v in changed.velocities] == [0.1, 0.0, 0.1]
    assert changed.sensors == Sensors.usual(1.0, 0.003)
    assert [force.robot for force in changed.disturbances] == [0, 2]
    assert (changed.planner, changed.seed, changed.duration) == ("distributed", 5, 2.0)
    assert bars_overridden(rough) == rough
    assert bars_overridden(rough, terrain="blocks").ground.height == rough.ground.height
    assert bars_overridden(rough, terrain="rough:0.1").ground.height == 0.1


def test_options_that_bars_have_not_are_refused():
    with pytest.raises(InputError, match="--gait: robots on bars have no such setting"):
        overridden(open_any("bar"), gait="trot")
    with pytest.raises(InputError, match="'trot' is carried by hands"):
        bars_overridden(open_any("trot"))


def test_a_file_is_checked_and_run(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("carry: bars\nduration: 0.1\nteam: {payload: 1}\n")
    result = CliRunner().invoke(app, ["scenario", "check", str(path)])
    assert result.exit_code == 0, result.output
    options = ["--headless", "--no-video", "--out", str(tmp_path), "--velocity", "0.1"]
    result = CliRunner().invoke(app, ["demo", str(path), *options])
    assert result.exit_code == 0, result.output
    figures = json.loads((tmp_path / "mine" / "mine.json").read_text())
    assert figures["settings"]["team"]["payload"] == 1.0
    assert figures["settings"]["velocity"]["vx"] == 0.1
    assert figures["duration_s"] == pytest.approx(0.1)
    path.write_text("carry: bars\nground: {kind: rough}\nvelocity: {vx: -0.5}\n")
    result = CliRunner().invoke(app, ["scenario", "check", str(path)])
    assert result.exit_code == 2
    assert "told to walk off its ground" in result.output
