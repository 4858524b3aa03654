"""The planners of the layered problem against a solved case and against their own model."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from palanquin.errors import ProblemError
from palanquin.events import Event, EventKind
from palanquin.problems.layered import (
    PRINTED,
    TRUNK_INERTIA,
    WORKING,
    CentralizedPlanner,
    Desired,
    DistributedPlanner,
    LinkSettings,
    NominalPlanner,
    RobotStates,
    Team,
)

DATA = Path(__file__).parent.parent / "data" / "layered"
CASE = json.loads((DATA / "holonomic_trot.json").read_text())
EXPECTED = json.loads((DATA / "holonomic_trot.expected.json").read_text())
TEAM = Team(inertias=(TRUNK_INERTIA, TRUNK_INERTIA))


def instant():
    """States, contacts and references of the case."""
    s = CASE["state"]
    states = RobotStates(*(np.array(s[key], dtype=float) for key in ("r", "v", "R", "w", "feet")))
    contacts = np.tile(np.array(s["stance"], dtype=bool), (6, 1, 1))
    return states, contacts, Desired(np.array(s["des_r"], float), np.array(s["des_v"], float))


@pytest.mark.parametrize(
    ("planner", "name"), [(CentralizedPlanner, "centralized"), (NominalPlanner, "nominal")]
)
@pytest.mark.parametrize("qp", ["structured", "osqp"])
def test_optimum_of_the_case(planner, name, qp):
    options = {
        "qp_settings": {
            "osqp": {
                "absolute_tolerance": 1e-9,
                "relative_tolerance": 1e-9,
                "max_iterations": 50000,
            }
        }
    }
    plan = planner(TEAM, PRINTED, qp, **options).plan(0.0, *instant())
    assert plan.is_usable
    assert plan.cost[0] == pytest.approx(EXPECTED[name]["obj"], rel=1e-6)
    forces = np.array(EXPECTED[name]["u"]).reshape(2, 4, 3)
    assert plan.forces == pytest.approx(forces, abs=5e-3)


def test_swing_legs_push_nothing_and_stance_legs_stay_in_their_pyramids():
    states, contacts, desired = instant()
    desired = Desired(desired.position, desired.velocity + np.array([[5.0, -3, 0], [-5, 3, 0]]))
    plan = CentralizedPlanner(TEAM, PRINTED).plan(0.0, states, contacts, desired)
    forces, stands = plan.inputs, contacts[:-1]
    assert (forces[~stands] == 0).all()
    f = forces[stands]
    limit = PRINTED.friction / np.sqrt(2) * f[:, 2:3]
    assert (f[:, 2] >= -1e-7).all()
    assert (np.abs(f[:, :2]) <= limit + 1e-6).all()
    assert (np.abs(f[:, :2]) >= limit - 1e-6).any()  # or the pyramids would say little


def test_contradicting_bounds_fall_back_and_name_their_rows():
    states, contacts, desired = instant()
    planner = CentralizedPlanner(TEAM)
    good = planner.plan(0.0, states, contacts, desired)
    planner.mpc.params["robot2.normal"] = [50.0, 10.0]
    plan = planner.plan(0.005, states, contacts, desired)
    assert not plan.is_usable
    assert "normal" in plan.event
    assert "robot2" in plan.event
    assert planner.events == [Event(0.005, EventKind.KEPT_PLAN, plan.event)]
    np.testing.assert_array_equal(plan.forces, good.inputs[1])


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("position", np.zeros((3, 3)), r"states.position has shape \(3, 3\)"),
        ("velocity", np.full((2, 3), np.nan), r"states.velocity\[0, 0\] is nan"),
        ("feet", np.full((2, 4, 3), np.inf), r"states.feet\[0, 0, 0\] is inf"),
    ],
)
def test_bad_states_are_named(field, value, message):
    states, contacts, desired = instant()
    bad = RobotStates(**{**states.__dict__, field: value})
    with pytest.raises(ProblemError, match=message):
        CentralizedPlanner(TEAM).plan(0.0, bad, contacts, desired)


def test_bad_contacts_are_named():
    states, contacts, desired = instant()
    with pytest.raises(ProblemError, match=r"contacts has shape \(3, 2, 4\)"):
        CentralizedPlanner(TEAM).plan(0.0, states, contacts[:3], desired)


def test_the_dynamics_of_the_qp_are_finite_differences():
    states, contacts, desired = instant()
    planner = CentralizedPlanner(TEAM)
    planner.plan(0.0, states, contacts, desired)
    mpc = planner.mpc
    columns = np.concatenate(
        [planner.state_columns.ravel(), planner.force_columns.ravel(), planner.bar_columns]
    )
    free = np.isin(columns, planner.force_columns[~contacts[0]], invert=True)
    z, p, h = mpc.guess[0].copy(), mpc.params.values[0], 1e-6
    matrix = mpc.linearise().stage(0).dynamics
    for j, column in enumerate(columns[free]):
        step = np.zeros_like(z)
        step[column] = h
        ahead, behind = mpc.lowered.step(z + step, p), mpc.lowered.step(z - step, p)
        slope = (ahead - behind)[planner.state_columns.ravel()] / (2 * h)
        np.testing.assert_allclose(matrix[:, j], slope, atol=1e-6)


def test_repeated_exchanges_lead_to_the_centralized_plan():
    states, contacts, desired = instant()
    desired = Desired(desired.position, np.array([[0.3, 0.1, 0.0], [0.3, -0.1, 0.0]]))
    central = CentralizedPlanner().plan(0.0, states, contacts, desired)

    def error(**changes):
        plan = DistributedPlanner(settings=replace(WORKING, **changes)).plan(
            0.0, states, contacts, desired
        )
        return np.abs(plan.forces - central.forces).max(), plan.estimates[:, 0]

    once, _ = error()
    often, estimates = error(exchanges=60)
    assert often < 0.02 < 1.0 < once
    assert estimates == pytest.approx(central.multipliers[0], abs=0.02)
    alone, _ = error(exchanges=60, dual_terms=False)
    assert alone > 1.0  # the neighbours' multipliers are what makes it so


def test_planners_hear_over_their_links():
    states, contacts, desired = instant()
    desired = Desired(desired.position, np.array([[0.3, 0.1, 0.0], [0.3, -0.1, 0.0]]))

    def forces(**link):
        links = {(0, 1): LinkSettings(**link), (1, 0): LinkSettings(**link)}
        planner = DistributedPlanner(links=links)
        plans = [planner.plan(0.005 * n, states, contacts, desired) for n in range(6)]
        assert all(plan.is_usable for plan in plans)
        return np.array([plan.forces for plan in plans])

    deaf, slow, plain = forces(loss=1.0), forces(delay=3), forces()
    np.testing.assert_array_equal(forces(delay=100), deaf)  # only ever the greeting
    np.testing.assert_array_equal(slow[:3], deaf[:3])
    assert np.abs(slow[3] - deaf[3]).max() > 0.1
    np.testing.assert_array_equal(plain[0], deaf[0])
    assert np.abs(plain[1] - deaf[1]).max() > 0.1
    biased = forces(bias=20.0, bias_from=2)
    np.testing.assert_array_equal(biased[:2], plain[:2])
    assert np.abs(biased[2] - plain[2]).max() > 0.1


def test_links_between_strangers_are_refused():
    with pytest.raises(ProblemError, match=r"links has \[\(0, 5\)\]"):
        DistributedPlanner(links={(0, 5): LinkSettings()})


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"delay": 0}, "link.delay is 0"),
        ({"loss": -0.1}, "link.loss is -0.1"),
        ({"loss": 1.5}, "link.loss is 1.5"),
        ({"bias": float("nan")}, "link.bias is nan"),
    ],
)
def test_bad_links_are_named(options, message):
    with pytest.raises(ProblemError, match=message):
        LinkSettings(**options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"horizon": 0}, "settings.horizon is 0"),
        ({"dt": -1.0}, "settings.dt is -1.0"),
        ({"position": (1.0, -1.0, 1.0)}, "settings.position"),
        ({"acceleration": "soft"}, "settings.acceleration is 'soft'"),
        ({"normal": (5.0, 1.0)}, "settings.normal"),
    ],
)
def test_bad_settings_are_named(options, message):
    with pytest.raises(ProblemError, match=message):
        replace(WORKING, **options)


def stretched(**changes):
    """A plan for robots that move apart, and how fast d(|p_1 - p_2|^2 / 2)/dt is at its next knot;
    it is 0.2 m^2/s now.
    """
    states, contacts, desired = instant()
    apart = states.velocity + np.array([[0.0, 0.1, 0.0], [0.0, -0.1, 0.0]])
    planner = CentralizedPlanner(settings=replace(WORKING, **changes))
    plan = planner.plan(0.0, replace(states, velocity=apart), contacts, desired)
    arms = np.asarray(planner.team.bars[0].attach)
    points = plan.position + np.einsum("iab,ib->ia", plan.rotation, arms)
    turning = np.cross(plan.angular_velocity, arms)
    velocities = plan.velocity + np.einsum("iab,ib->ia", plan.rotation, turning)
    return plan, (points[0] - points[1]) @ (velocities[0] - velocities[1])


def test_rows_may_be_hard_penalised_or_off():
    rates = []
    for policy in ("off", 1e4, 1e6, "hard"):
        plan, rate = stretched(acceleration="off", rate=policy)
        assert plan.is_usable
        rates.append(rate)
    off, soft, stiff, hard = np.abs(rates)
    assert off > 0.05 > hard
    assert off > 1.2 * soft > 10 * stiff > 20 * hard
    _, kept = stretched(acceleration="hard", rate="off")
    assert kept == pytest.approx(0.2, abs=1e-3)  # a bar that can't stretch faster


def test_a_slack_keeps_rows_that_contradict_each_other_feasible():
    """The rate can't vanish at once while the acceleration does."""
    plan, _ = stretched(rate="hard")
    assert not plan.is_usable
    assert "bar.rate" in plan.event
    plan, rate = stretched(rate="hard", slack=1e3)
    assert plan.is_usable
    assert abs(rate) < 1e-3
    rates = [stretched(rate="off", slack=weight)[1] for weight in (1e-2, 1e5)]
    assert rates[0] < 0.1  # nobody minds the slack
    assert rates[1] == pytest.approx(0.2, abs=1e-3)
