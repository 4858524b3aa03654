"""Plans that come seldom are followed knot by knot until the next one."""

import numpy as np
import pytest

from palanquin.sim.runs.nominal import feet_after, landed_feet, nominal_step
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import open_scenario

TROT = open_scenario("trot")


def at_rate(rate, **changes):
    return TROT.changed(planner={**dict(TROT.planner), "rate": rate}, **changes)


@pytest.mark.parametrize("rate", [4.0, 11.0])
def test_a_team_walks_on_few_plans(rate):
    scenario = at_rate(rate, duration=3.0)
    figures = outcome(run_scenario(scenario))
    assert figures["completed"]
    assert figures["fallbacks"] == 0
    assert max(figures["violation"].values()) < 1e-3
    assert figures["payload_position_error_m"]["max"] < 2e-3


def test_a_period_of_several_intervals_goes_through_the_plan():
    """Without disturbances the model arrives where a converged plan says, feet included."""
    planner = TROT.build_planner()
    state = TROT.start(planner)
    command = TROT.command.at(0.0)
    plan = planner.settle(0.0, state, command)
    state = type(state)(state.bodies, landed_feet(plan, state.feet))
    for knots in (1, 4, 9):
        bodies = nominal_step(planner, plan, state, knots * planner.dt)
        np.testing.assert_allclose(bodies, plan.bodies[knots], atol=1e-6)
        feet = feet_after(planner, plan, state.feet, knots * planner.dt)
        stood = plan.contacts[knots - 1]
        np.testing.assert_allclose(feet[stood], plan.feet[knots - 1][stood], atol=1e-9)
    half = nominal_step(planner, plan, state, 2.5 * planner.dt)
    middle = (plan.bodies[2] + plan.bodies[3]) / 2
    np.testing.assert_allclose(half[:, :3], middle[:, :3], atol=1e-3)
