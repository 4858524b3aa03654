"""Robots' references over their own ground: (14) on planes, within reach over a ramp's edge."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palanquin.errors import ProblemError
from palanquin.problems import clm, quaternions, terrains
from palanquin.problems.clm.references import ANGULAR_VELOCITY, ORIENTATION, POSITION, VELOCITY

STRIDE = 0.14
"""How far a body moves while a foot stands in the demos' fastest trot, m."""


def references(team, terrain, start, command, horizon=15, dt=1 / 30, robots="ground"):
    return clm.make_references(team, terrain, np.array(start), command, horizon, dt, robots)


def hips(team, bodies):
    robots = bodies[:, 1:, None]
    return robots[..., POSITION] + quaternions.rotate(robots[..., ORIENTATION], team.hips())


def across(team, terrain, yaw, robots):
    """States [n, R+1, 13] of the team all the way over a ramp."""
    states = [
        references(team, terrain, (x, 0.0, yaw), clm.Velocity(0.4), 0, robots=robots).bodies
        for x in np.linspace(-1.0, 6.0, 60)
    ]
    return np.concatenate(states)


def longest_legs(team, bodies, terrain):
    """Longest of each robot's legs [n, R] if feet stand up to half a stride off their hips, m."""
    forward = quaternions.rotate(bodies[:, 1:, None, ORIENTATION], np.array([1.0, 0.0, 0.0]))
    lengths = []
    for offset in np.linspace(-STRIDE / 2, STRIDE / 2, 5):
        feet = hips(team, bodies) + offset * forward
        feet[..., 2] = terrain.height(feet[..., 0], feet[..., 1])
        lengths.append(np.linalg.norm(feet - hips(team, bodies), axis=-1).max(axis=-1))
    return np.max(lengths, axis=0)


@pytest.mark.parametrize("terrain", [terrains.Flat(0.3), terrains.Plane(0.1, 0.5, -0.2)])
def test_on_planes_they_are_those_of_the_paper(team, terrain):
    for start in ((0.0, 0.0, 0.0), (1.0, -2.0, 2.5)):
        # A formula is not known to be a plane, and takes the long way.
        formula = terrains.Formula(lambda x, y: terrain.expression(x, y, terrain.parameters()))
        ours = references(team, formula, start, clm.Velocity(0.4, -0.1))
        papers = references(team, terrain, start, clm.Velocity(0.4, -0.1), robots="rigid")
        np.testing.assert_allclose(ours.bodies, papers.bodies, atol=1e-12)
        np.testing.assert_allclose(ours.footholds, papers.footholds, atol=1e-12)


@pytest.mark.parametrize("slope", [0.8, -0.8, 0.5])
@pytest.mark.parametrize("yaw", [0.0, 0.6, 1.57])
def test_legs_and_arms_reach_all_the_way_over_a_ramp(team, slope, yaw):
    terrain = terrains.Ramp(1.6, slope, 2.5)
    bodies = across(team, terrain, yaw, "ground")
    reach = np.array([carrier.model.leg_length for carrier in team.carriers])
    assert (longest_legs(team, bodies, terrain) < reach - 0.03).all()
    base = quaternions.rotate(
        bodies[:, 1:, ORIENTATION], np.array([carrier.model.arm for carrier in team.carriers])
    )
    hand = quaternions.rotate(bodies[:, :1, ORIENTATION], team.attach())
    arm = bodies[:, :1, POSITION] + hand - bodies[:, 1:, POSITION] - base
    assert (np.linalg.norm(arm, axis=-1) < 0.36).all()  # of 0.4


def test_the_papers_references_leave_the_legs_reach_at_the_upper_edge(team):
    terrain = terrains.Ramp(1.6, 0.8, 2.5)
    bodies = across(team, terrain, 0.0, "rigid")
    reach = np.array([carrier.model.leg_length for carrier in team.carriers])
    assert (longest_legs(team, bodies, terrain) > reach).any()


def test_velocities_are_the_derivatives_of_the_poses(team):
    dt = 1e-5
    terrain = terrains.Ramp(1.6, 0.8, 2.5)
    command = clm.Velocity(0.4, 0.0, 0.3)
    now, later = references(team, terrain, (3.3, 0.1, 0.3), command, 1, dt).bodies[:, 1:]
    moved = (later[:, POSITION] - now[:, POSITION]) / dt
    np.testing.assert_allclose(moved, now[:, VELOCITY], atol=1e-6)
    turned = quaternions.multiply(quaternions.conjugate(now[:, ORIENTATION]), later[:, ORIENTATION])
    spin = Rotation.from_quat(np.roll(turned, -1, axis=-1)).as_rotvec() / dt
    np.testing.assert_allclose(spin, now[:, ANGULAR_VELOCITY], atol=1e-6)


def test_unknown_kinds_are_refused(team):
    with pytest.raises(ProblemError, match=r"robots are 'free'; they must be one of rigid"):
        references(team, terrains.Flat(), (0, 0, 0), clm.Velocity(), robots="free")
