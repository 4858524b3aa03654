"""One protocol for all planners, of a payload in hands and of robots on bars."""

from dataclasses import replace

import numpy as np
import pytest

from palanquin.errors import ProblemError
from palanquin.events import Event
from palanquin.problems import clm, gaits
from palanquin.problems.gaits import GaitClock
from palanquin.problems.layered import CentralizedPlanner, DistributedPlanner, NominalPlanner
from palanquin.problems.layered.bar_planner import BarPlanner
from palanquin.problems.layered.reference import STANDING_HEIGHT, within_circle
from palanquin.problems.planning import Command, Measurement, Plan, Planner, Velocity
from palanquin.sim.runs.loop import as_fields
from palanquin.sim.runs.record import tick_shapes

ROBOTS = 2
PLANNERS = ("hands", "centralized", "distributed", "nominal")
KINDS = {
    "centralized": CentralizedPlanner, "distributed": DistributedPlanner, "nominal": NominalPlanner,
}  # fmt: skip


class Clocks:
    """Gait clocks of robots whose feet nobody moves."""

    def __init__(self):
        self.clocks = [GaitClock(gaits.trot(0.4)) for _ in range(ROBOTS)]

    def contacts(self, times):
        return np.stack([clock.contacts(times) for clock in self.clocks], axis=1)

    def change_gait(self, robot, gait, time, at_once=False):
        return self.clocks[robot].change(gait, time, at_once)


def made(kind: str) -> tuple[Planner, Measurement]:
    """A planner, and a team that stands before it."""
    if kind == "hands":
        carriers = tuple(clm.Carrier(n, (0.0, y, 0.0)) for n, y in (("a", 0.6), ("b", -0.6)))
        hands = clm.Planner(clm.build_clm(clm.Team(clm.Payload(), carriers)))
        state = hands.nominal_state()
        bodies, feet = state.bodies, state.feet
        return hands, Measurement(0.0, bodies, feet, feet, np.zeros(ROBOTS))
    bodies, feet = np.zeros((ROBOTS, 13)), np.zeros((ROBOTS, 4, 3))
    bodies[:, 1], bodies[:, 2], bodies[:, 3] = (0.5, -0.5), STANDING_HEIGHT, 1.0
    hips = np.array([[0.18, 0.13], [0.18, -0.13], [-0.18, 0.13], [-0.18, -0.13]])
    feet[..., :2] = bodies[:, None, :2] + hips
    on_bars = BarPlanner(KINDS[kind](), Clocks(), within_circle(0.15))
    return on_bars, Measurement(0.0, bodies, feet, feet, np.zeros(ROBOTS))


@pytest.mark.parametrize("kind", PLANNERS)
def test_a_planner_answers_by_the_same_words(kind):
    planner, seen = made(kind)
    knots = planner.plan_time
    n, bodies = len(knots) - 1, len(seen.bodies)
    assert knots[0] == 0.0
    assert (np.diff(knots) > 0).all()
    assert planner.reference_at(0.0).shape == (3,)
    planner.expect_wrenches(np.zeros((n + 1, bodies, 6)))
    plan = planner.plan(seen, Command((Velocity(0.2),)))

    assert plan.time == 0.0
    assert plan.bodies.shape == (n + 1, bodies, 13)
    np.testing.assert_allclose(plan.bodies[0], seen.bodies, atol=1e-9)
    assert plan.feet.shape == plan.forces.shape == (n, ROBOTS, 4, 3)
    assert plan.contacts.shape == (n + 1, ROBOTS, 4)
    assert plan.reference.shape == (bodies, 13)
    assert plan.is_usable
    assert plan.status
    assert plan.solve_ms > 0
    assert max(plan.violation.values()) < 1e-2
    assert all(isinstance(event, Event) for event in plan.events)
    # Standing feet bear the weight, others nothing.
    loads = plan.forces[..., 2]
    np.testing.assert_allclose(loads[~plan.contacts[:-1]], 0.0, atol=1e-6)
    assert loads[0].sum() > 9.81 * 10 * ROBOTS


@pytest.mark.parametrize("kind", PLANNERS)
def test_a_plan_makes_a_tick_of_a_record(kind):
    planner, seen = made(kind)
    plan = planner.plan(seen, Command((Velocity(),)))
    fields = as_fields(plan)
    shapes = tick_shapes(len(seen.bodies), ROBOTS, len(planner.plan_time) - 1)
    for name in fields.keys() & shapes.keys():
        assert np.shape(fields[name]) == shapes[name], name
    assert shapes.keys() - fields.keys() == {"time", "x", "feet"}  # the measurement's


@pytest.mark.parametrize("kind", PLANNERS)
def test_plans_follow_commands_clocks_and_changes_of_gait(kind):
    planner, seen = made(kind)
    still = planner.plan(seen, Command((Velocity(),)))
    assert not still.contacts.all()
    assert planner.change_gait(0, gaits.stand(), 0.0, at_once=True) == 0.0
    later = replace(seen, time=0.01)
    plan = planner.plan(later, Command((Velocity(0.3), Velocity(0.3))))
    assert plan.contacts[:, 0].all()
    assert not plan.contacts[:, 1].all()
    ahead = plan.bodies[-1, :, 7] - still.bodies[-1, :, 7]
    assert (ahead > 1e-4).all()
    reached = planner.reference_at(0.01)
    assert 0 <= reached[0] <= 0.3 * 0.01 + 1e-12


@pytest.mark.parametrize("kind", PLANNERS)
def test_time_does_not_go_back_and_states_are_finite(kind):
    planner, seen = made(kind)
    planner.plan(replace(seen, time=1.0), Command((Velocity(),)))
    with pytest.raises(ProblemError, match="time is 0"):
        planner.plan(seen, Command((Velocity(),)))
    broken = seen.bodies.copy()
    broken[0, 2] = np.nan
    with pytest.raises(ProblemError):
        planner.plan(replace(seen, time=2.0, bodies=broken), Command((Velocity(),)))


def test_pushes_are_known_where_the_model_has_a_place_for_them():
    wrenches = np.zeros((16, 3, 6))
    wrenches[:, 0, 0] = 50.0
    planner, seen = made("hands")
    calm = planner.plan(seen, Command((Velocity(),)))
    planner.expect_wrenches(wrenches)
    told = planner.plan(replace(seen, time=1 / 30), Command((Velocity(),)))
    assert np.abs(told.forces[..., 0]).sum() > 2 * np.abs(calm.forces[..., 0]).sum()
    with pytest.raises(ProblemError, match="cannot be told of pushes"):
        made("centralized")[0].expect_wrenches(wrenches)


@pytest.mark.parametrize("kind", PLANNERS)
def test_nothing_of_the_protocol_is_missing(kind):
    planner, seen = made(kind)
    plan = planner.plan(seen, Command((Velocity(),)))
    for protocol, found in ((Planner, planner), (Plan, plan)):
        names = {name for name in vars(protocol) if not name.startswith("_")}
        assert names <= set(dir(found))
