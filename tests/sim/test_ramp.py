"""A team walks over the upper edge of the paper's steepest ramp, up and down, within its reach."""

import numpy as np
import pytest

from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import open_scenario
from palanquin.sim.show.legs import leg_lengths, leg_limits

PERIOD, DURATION = 1 / 30, 5.0
REACH = 1e-3  # m, of which a leg may be too long


def walk(slope, x, references):
    """From payload position `x`, in the middle of the steep part, over the edge or from it."""
    # From rest on a slope of 0.8, friction of 0.8 would leave nothing to speed up with.
    scenario = open_scenario("ramp").changed(
        terrain={"type": "ramp", "H": 1.6, "kappa": slope, "xg": 0.0},
        command={"type": "velocity", "steps": [{"vx": 0.4}]},
        gait_changes=[],
        planner={"references": references, "friction": 1.0},
        duration=DURATION,
    )
    planner = scenario.build_planner()
    planner.reference = np.array([x, 0.0, 0.0])
    rollout = run_scenario(scenario, planner)
    return planner.team, rollout, outcome(rollout)


@pytest.mark.parametrize(("slope", "x"), [(0.8, 0.5), (-0.8, -1.5)])
def test_no_leg_is_too_short_over_the_edge(slope, x):
    _, _, result = walk(slope, x, "ground")
    assert result["completed"]
    assert result["fallbacks"] == 0
    assert result["violation"]["leg"] < REACH
    assert result["violation"]["arm"] < REACH
    assert result["payload_position_error_m"]["rms"] < 0.01


def test_the_papers_references_take_the_legs_to_their_limits():
    # Figure 7 of the paper: at the upper edge the hind legs are stretched to the end; ours are not.
    longest = {}
    for references in ("rigid", "ground"):
        team, rollout, _ = walk(0.8, 0.5, references)
        lengths = leg_lengths(team, rollout.x.reshape(len(rollout.x), -1, 13), rollout.feet)
        longest[references] = (lengths.max(axis=(0, 2)) - leg_limits(team)).max()
    assert abs(longest["rigid"]) < 2e-3
    assert longest["ground"] < -0.04


def test_the_climb_looks_ahead_and_its_references_can_be_the_papers():
    climb = open_scenario("ramp")
    assert climb.build_planner().footholds == "raibert"
    settings = {**dict(climb.planner), "references": "rigid"}
    states = [
        climb.changed(planner=chosen).build_planner().nominal_state(np.array([3.0, 0.0, 0.0]))
        for chosen in (climb.planner, settings)
    ]
    assert np.abs(states[0].bodies - states[1].bodies).max() > 0.01
