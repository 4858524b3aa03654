"""A team walks over ditches in closed loop, one SQP iteration a period, from one start."""

import numpy as np
import pytest

from palanquin.problems.clm.clear_ground import ditch_depths
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import open_scenario

PERIOD = 1 / 30
# Two of the widest, so close that no foot has more than 12 cm between them, and a slanted one.
DITCHES = ((1.0, 0.0, -0.36, 0.32), (1.0, 0.0, -0.8, 0.32), (1.0, 0.2, -1.4, 0.25))


@pytest.mark.parametrize(("gait", "speed"), [("trot", 0.4), ("pace", 0.4), ("crawl", 0.15)])
def test_no_foot_lands_in_a_ditch(gait, speed):
    duration = round(2.0 / speed / PERIOD) * PERIOD
    scenario = open_scenario("ditch").changed(
        robots=[{**dict(robot), "gait": gait} for robot in open_scenario("ditch").robots],
        ditches={
            "type": "lines",
            "lines": [dict(zip("abcd", line, strict=True)) for line in DITCHES],
        },
        command={"type": "velocity", "steps": [{"vx": speed}]},
        duration=duration,
    )
    rollout = run_scenario(scenario)
    standing = rollout.feet[rollout.contact > 0.5]
    assert ditch_depths(standing[:, :2], np.array(DITCHES)).max() < 1e-3
    assert rollout.feet[-1, :, 2:, 0].min() > 1.0  # the last hind foot past the second ditch
    result = outcome(rollout)
    assert result["completed"]
    assert result["fallbacks"] == 0
    assert result["payload_position_error_m"]["rms"] < 0.05
    assert result["violation"]["leg"] < 1e-3
