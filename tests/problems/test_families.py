"""Families of inequalities register once: builder, files, documents and figures follow."""

from dataclasses import dataclass

import numpy as np
import pytest
from pydantic import ValidationError

from palanquin.cli.scenario_fields import reference
from palanquin.errors import ProblemError
from palanquin.policies import Penalty
from palanquin.problems import clm
from palanquin.problems import modules as m
from palanquin.problems.modules import families
from palanquin.problems.modules.families import Family, limit, register, values_of
from palanquin.sim.scenarios.settings import planner_settings


# What the file of a new family holds: its limits, its rows and its registration.
@dataclass(frozen=True)
class Pull:
    """Largest horizontal force of a hand."""

    most: float = limit(40.0, "along each axis of the world, N")


def add_pulls(problem, pull):
    for hand in problem.handles(m.Hand):
        most = problem.parameter(f"{hand.robot.name}.pull", 1, values_of(pull))
        for axis in (0, 1):
            for sign in (1, -1):
                row = (sign * hand.force[axis] - most) / 100.0
                options = {"scale": 100.0, "robot": hand.robot.name, "limb": "hand"}
                problem.inequality("pull", row, families.FAMILIES["pull"].policy, **options)


@pytest.fixture
def pull():
    """The family as the second file's import would register it."""
    family = Family(
        "pull", Penalty(stiffness=4200.0, smoothing=1e-3), unit=100.0, option="pull",
        limits=Pull, add=add_pulls, meaning="limits of what hands pull",
    )  # fmt: skip
    register(family)
    yield family
    del families.FAMILIES["pull"]


def test_the_builder_adds_it_and_it_holds(pull, team):
    def largest(**options):
        planner = clm.Planner(clm.build_clm(team, **options), max_iterations=30)
        state = planner.nominal_state()
        wrenches = np.zeros((planner.horizon + 1, len(team.bodies), 6))
        wrenches[:, 0, 0] = 150.0  # the payload is pushed, and known to be
        planner.expect_wrenches(wrenches)
        plan = planner.settle(0.0, state, clm.Velocity(0.0))
        return np.abs(plan.hand_wrenches[..., 0]).max(), plan.plan.violation

    free, _ = largest()
    held, violation = largest(limits={"pull": Pull(30.0)})
    assert free > 60.0
    assert held < 40.0
    assert set(violation) >= {"leg", "pull"}
    assert m.unit_of("pull") == 100.0


def test_files_and_documents_have_it(pull):
    settings = planner_settings()
    given = settings.model_validate({"pull": {"most": 30.0}})
    assert given.limits() == {"pull": Pull(30.0)}
    assert settings().limits() == {}
    with pytest.raises(ValidationError, match="unknown key 'least'; valid keys are most"):
        settings.model_validate({"pull": {"least": 1.0}})
    with pytest.raises(ValidationError):
        settings.model_validate({"pull": {"most": -1.0}})
    assert settings.model_validate({"penalties": {"pull": {"stiffness": 1.0}}})
    text = reference(settings.model_json_schema())
    assert "| `pull` | Pull |  | limits of what hands pull; none unless told |" in text
    assert "| `most` | number over 0 | `40.0` | along each axis of the world, N |" in text


def test_names_are_taken_once(pull):
    with pytest.raises(ProblemError, match="'pull' or its option is registered already"):
        register(pull)


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ({"push": Pull()}, "'push' is not known; there are .*hand_cone, pull"),
        ({"pull": 3.0}, "pull is 3.0; Pull is needed"),
        ({"hand_cone": Pull()}, "WrenchCone is needed"),
    ],
)
def test_bad_limits_are_refused(pull, team, limits, message):
    with pytest.raises(ProblemError, match=message):
        clm.build_clm(team, limits=limits)


def test_the_shipped_families_are_registered():
    units = {"normal": 100.0, "friction": 100.0, "hand": 100.0, "leg_torque": 40.0}
    units |= {"arm_torque": 40.0}
    names = {"leg", "arm", "ditch", "area", "collision", *units}
    assert names == families.FAMILIES.keys()
    assert units == {f.name: f.unit for f in families.FAMILIES.values() if f.unit != 1.0}
