"""Every gait with every size of team, one SQP iteration a period: who walks keeps all limits."""

import pytest

from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import open_scenario, with_robots
from palanquin.sim.show.legs import leg_lengths, leg_limits

DURATION = 2.0
MODELS = ("laikago", "aliengo", "a1", "laikago")


@pytest.mark.parametrize("robots", [1, 2, 3, 4])
@pytest.mark.parametrize("gait", ["trot", "pace", "bound", "pronk", "crawl"])
def test_a_mixed_team_walks_within_its_limits(gait, robots):
    scenario = with_robots(open_scenario("trot"), robots)
    members = zip(scenario.robots, MODELS, strict=False)
    scenario = scenario.changed(
        robots=[{**dict(robot), "gait": gait, "model": model} for robot, model in members],
        command={"type": "velocity", "steps": [{"vx": 0.3}]},
        duration=DURATION,
    )
    rollout = run_scenario(scenario)
    result = outcome(rollout)
    assert result["completed"]
    assert result["fallbacks"] == 0
    assert result["payload_position_error_m"]["max"] < 0.02
    violation = result["violation"]
    assert max(violation["normal"], violation["friction"]) < 0.01  # 1 N
    # A plan whose end has just seen a bound's flight may be some millimetres off there, for one
    # period; what is executed keeps within reach.
    assert max(violation["leg"], violation["arm"]) < 1e-2
    bodies = rollout.x.reshape(len(rollout.time), -1, 13)
    lengths = leg_lengths(scenario.team, bodies, rollout.feet)
    assert (lengths - leg_limits(scenario.team)[:, None]).max() < 1e-3


def test_a_foot_that_lifts_off_stretched_keeps_within_reach():
    # From where it stood, on its reach's limit, a plan's step took it 4 cm beyond.
    scenario = with_robots(open_scenario("trot"), 2)
    members = [{**dict(robot), "gait": "crawl"} for robot in scenario.robots]
    rollout = run_scenario(scenario.changed(robots=members, duration=1.5))
    assert rollout.violation["leg"].max() < 1e-3
