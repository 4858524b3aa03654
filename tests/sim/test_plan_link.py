"""Plans that come late or never."""

from itertools import islice

import numpy as np
import pytest

from palanquin.sim.errors import InputError
from palanquin.sim.runs.plan_link import PlanLink
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import loop_of, run_scenario
from palanquin.sim.scenarios import open_scenario
from palanquin.sim.scenarios.physical import physical

TROT = open_scenario("trot")


def planned_with(duration=1.5, **planner):
    return physical(TROT.changed(duration=duration, planner=planner))


def test_without_latency_a_plan_arrives_at_once():
    link = PlanLink()
    with pytest.raises(LookupError):
        link.at(0)
    for step in (0, 10, 20):
        link.send(step, step)
        assert link.at(step)[0] == step


def test_a_plan_arrives_after_its_latency_but_for_the_first():
    link = PlanLink(latency=25)
    for step in (0, 10, 20):
        link.send(step, step)
    assert link.at(0) == (0, 35)
    assert link.at(34) == (0, 1)
    assert link.at(35) == (10, 10)
    assert link.at(45)[0] == 20
    link.follow(60)
    assert link.oldest == 40


def test_the_share_that_is_told_is_lost_and_never_the_first():
    def arrived(seed):
        link = PlanLink(lost=0.3, seed=seed)
        plans = []
        for step in range(2000):
            link.send(step, step)
            plans.append(link.at(step)[0])
        assert plans[0] == 0
        assert link.lost == 2000 - len(set(plans))
        return link.lost, plans

    lost, plans = arrived(1)
    assert lost == pytest.approx(0.3 * 2000, rel=0.1)
    assert arrived(1)[1] == plans != arrived(2)[1]


def test_late_plans_are_followed_on():
    figures = outcome(run_scenario(planned_with(latency=0.012)))
    assert figures["completed"]
    assert figures["plans"] == {"lost": 0, "oldest_s": pytest.approx(0.022)}
    assert figures["payload_position_error_m"]["max"] < 5e-3


def test_lost_plans_are_counted_and_survived():
    scenario = planned_with(lost=0.2)
    figures = outcome(run_scenario(scenario))
    assert figures["completed"]
    assert 0.1 * 150 < figures["plans"]["lost"] < 0.3 * 150
    assert figures["plans"]["oldest_s"] >= 0.02 - 1e-9
    assert figures["payload_position_error_m"]["max"] < 5e-3


def test_a_seed_draws_which_plans_are_lost():
    def lost(seed):
        loop = loop_of(planned_with(lost=0.5).changed(seed=seed))
        return np.diff([loop.plant.extremes()["lost_plans"] for _ in islice(loop.ticks(), 30)])

    np.testing.assert_array_equal(lost(3), lost(3))
    assert (lost(3) != lost(4)).any()


def test_a_latency_is_whole_physics_steps():
    with pytest.raises(InputError, match=r"planner\.latency: 0\.0125 s must be whole"):
        loop_of(planned_with(latency=0.0125))
