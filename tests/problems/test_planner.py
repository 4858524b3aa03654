"""The receding-horizon planner: its columns, its warm starts, its clock."""

from dataclasses import replace

import numpy as np
import pytest

from palanquin.errors import ProblemError
from palanquin.events import EventKind
from palanquin.plan import Status
from palanquin.problems import clm, gaits
from palanquin.problems.clm.columns import Columns
from palanquin.problems.clm.planner import Planner
from palanquin.problems.robots import FEET

COMMAND = clm.Velocity(0.4)
DT = 1 / 30


@pytest.fixture(scope="module")
def flat_problem():
    carriers = (clm.Carrier("left", (0.0, 0.6, 0.0)), clm.Carrier("right", (0.0, -0.6, 0.0)))
    return clm.build_clm(clm.Team(clm.Payload(), carriers))


@pytest.fixture
def planner(flat_problem):
    return Planner(flat_problem)


def test_columns_are_those_of_the_named_blocks(planner):
    z = planner.lowered.trajectory()
    z.values[:] = np.random.default_rng(0).normal(size=z.values.shape)
    columns = Columns.of(planner.lowered, planner.team)
    bodies, feet, forces, wrenches = (
        z.values[:, part]
        for part in (columns.bodies, columns.feet, columns.forces, columns.wrenches)
    )
    np.testing.assert_array_equal(bodies[:, 0, :3], z["payload.position"])
    np.testing.assert_array_equal(bodies[:, 2, 3:7], z["right.orientation"])
    np.testing.assert_array_equal(bodies[:, 1, 10:], z["left.angular_velocity"])
    for f, limb in enumerate(FEET):
        np.testing.assert_array_equal(feet[:, 1, f], z[f"right.{limb}.foot"])
        np.testing.assert_array_equal(forces[:, 0, f], z[f"left.{limb}.force"])
    np.testing.assert_array_equal(wrenches[:, 1, :3], z["right.hand.force"])
    np.testing.assert_array_equal(wrenches[:, 1, 3:], z["right.hand.torque"])


def test_settling_converges_from_cold(planner):
    plan = planner.settle(0.0, planner.nominal_state(), COMMAND).plan
    assert plan.status == Status.CONVERGED
    assert plan.equality_violation < 1e-8


def test_feet_that_stand_at_the_start_stay_where_they_were_measured(planner):
    state = planner.nominal_state()
    state.feet[..., :2] += 0.01
    plan = planner.solve(0.0, state, COMMAND)
    standing = plan.contacts[0]
    assert standing.any()
    assert not standing.all()
    np.testing.assert_array_equal(plan.feet[0][standing], state.feet[standing])


def test_newly_standing_feet_start_with_a_share_of_the_weight(planner):
    state = planner.nominal_state()
    planner.settle(0.0, state, COMMAND)
    plan = planner.solve(7 * DT, state, COMMAND)
    force = plan.plan.instance.guess[:, planner.columns.forces][..., 2]
    assert (force[plan.contacts] > 1.0).all()


def test_a_warm_start_is_a_plan_that_barely_changes(planner):
    state = planner.nominal_state()
    planner.settle(0.0, state, COMMAND)
    again = planner.solve(0.0, state, COMMAND).plan
    assert again.status == Status.CONVERGED
    assert again.equality_violation < 1e-8


def test_the_reference_moves_with_time_not_with_solves(planner):
    state = planner.nominal_state()
    for time in (0.0, 0.0, 0.1, 0.25):
        planner.solve(time, state, clm.Velocity(0.4, 0.0, 0.2))
    assert planner.reference[2] == pytest.approx(0.05)
    assert 0.0999 * 0.9 < planner.reference[0] < 0.1001


def test_time_does_not_go_back(planner):
    state = planner.nominal_state()
    planner.solve(1.0, state, COMMAND)
    with pytest.raises(ProblemError, match=r"time is 0.5 s; the last plan was made at 1.0 s"):
        planner.solve(0.5, state, COMMAND)
    with pytest.raises(ProblemError, match="time is nan"):
        planner.solve(float("nan"), state, COMMAND)


def lost(state):
    """A state from which nothing can be planned: its derivatives are not finite."""
    return replace(state, bodies=np.where(np.arange(13) == 0, 1e200, state.bodies))


@pytest.mark.parametrize("restart_after", [1, 3])
def test_a_run_of_failures_ends_with_a_restart(flat_problem, restart_after):
    planner = Planner(flat_problem, restart_after=restart_after)
    state = planner.nominal_state()
    good = planner.settle(0.0, state, COMMAND)
    assert good.events == ()
    failed = [planner.solve(n * DT, lost(state), COMMAND) for n in range(1, restart_after + 1)]
    for n, plan in enumerate(failed, start=1):
        assert not plan.plan.is_usable
        assert [event.kind for event in plan.events] == [EventKind.KEPT_PLAN]
        assert plan.events[0].time == n * DT
        assert plan.events[0].reason == plan.plan.message
    after = planner.solve((restart_after + 1) * DT, state, COMMAND)
    assert after.events[0].kind is EventKind.RESTART
    assert str(restart_after) in after.events[0].reason
    assert after.plan.is_usable
    assert EventKind.RESTART not in [
        event.kind for event in planner.solve((restart_after + 2) * DT, state, COMMAND).events
    ]


def test_a_step_that_was_not_ready_tells_of_its_restart(flat_problem):
    planner = Planner(flat_problem, restart_after=1)
    state = planner.nominal_state()
    planner.settle(0.0, state, COMMAND)
    planner.solve(DT, lost(state), COMMAND)
    assert not planner.prepare(2 * DT, lost(state), COMMAND)
    plan = planner.feedback(state)
    assert plan.events[0].kind is EventKind.RESTART
    assert plan.plan.is_usable
    assert planner.solve(3 * DT, state, COMMAND).events == ()


def test_a_restart_forgets_gaits_and_pushes(flat_problem):
    planner, fresh = Planner(flat_problem), Planner(flat_problem)
    state = planner.nominal_state()
    planner.solve(0.0, state, COMMAND)
    for clock in planner.clocks:
        clock.change(gaits.stand(), 0.0, at_once=True)
    planner.expect_wrenches(np.full((planner.horizon + 1, len(planner.team.bodies), 6), 5.0))
    planner.solve(DT, state, COMMAND)
    planner.restart()
    again, first = planner.solve(0.0, state, COMMAND), fresh.solve(0.0, state, COMMAND)
    assert np.array_equal(again.contacts, first.contacts)
    assert np.array_equal(again.plan.xs, first.plan.xs)


@pytest.mark.parametrize("robot", [-1, 2])
def test_a_clock_is_that_of_a_robot(planner, robot):
    with pytest.raises(IndexError):
        planner._core.clock(robot)


def test_a_planner_must_restart_some_time(flat_problem):
    with pytest.raises(ProblemError, match=r"planner\.restart_after is 0; it must be at least 1"):
        Planner(flat_problem, restart_after=0)


def test_two_phases_plan_as_one_call_does(flat_problem):
    one, two = Planner(flat_problem), Planner(flat_problem)
    state = one.nominal_state()
    for planner in (one, two):
        planner.settle(0.0, state, COMMAND)
    measured = replace(state, bodies=state.bodies + 0.0)
    measured.bodies[1, 7] += 0.01
    assert two.prepare(DT, state, COMMAND)
    answer, whole = two.feedback(measured), one.solve(DT, measured, COMMAND)
    np.testing.assert_array_equal(answer.bodies[0], measured.bodies)
    np.testing.assert_array_equal(answer.contacts, whole.contacts)
    assert answer.plan.is_usable
    assert answer.plan.cost == pytest.approx(whole.plan.cost, rel=1e-3)


def test_feedback_needs_a_preparation_and_one_start(flat_problem):
    planner = Planner(flat_problem)
    state = planner.nominal_state()
    with pytest.raises(ProblemError, match="nothing was prepared"):
        planner.feedback(state)
    planner.prepare(0.0, state, COMMAND)
    planner.feedback(state)
    with pytest.raises(ProblemError, match="nothing was prepared"):
        planner.feedback(state)
    with pytest.raises(ProblemError, match="no two phases"):
        Planner(flat_problem, candidates=2).prepare(0.0, state, COMMAND)


def test_feedback_to_a_bad_prediction_solves_from_scratch(flat_problem):
    planner = Planner(flat_problem)
    state = planner.nominal_state()
    planner.settle(0.0, state, COMMAND)
    assert not planner.prepare(DT, lost(state), COMMAND)
    plan = planner.feedback(state)
    assert plan.plan.is_usable
    np.testing.assert_array_equal(plan.bodies[0], state.bodies)
