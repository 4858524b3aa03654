"""The planners of the layered problem against a solved case and against their own model."""

import json
from pathlib import Path

import numpy as np
import pytest

from palanquin.errors import ProblemError
from palanquin.problems.layered import (
    PRINTED,
    TRUNK_INERTIA,
    CentralizedPlanner,
    Desired,
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
@pytest.mark.parametrize("qp", ["multipliers", "osqp"])
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
    assert planner.events == [(0.005, plan.event)]
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
