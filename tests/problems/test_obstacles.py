"""Obstacles: signed distances against brute force, and a team that keeps clear of a wall."""

import casadi as ca
import numpy as np
import pytest

from palanquin.errors import ProblemError
from palanquin.problem import Problem
from palanquin.problems import clm
from palanquin.problems import modules as m
from palanquin.problems.modules.obstacles import (
    beam_volume,
    box,
    cylinder,
    padded_obstacles,
    trunk_volume,
)
from palanquin.problems.modules.volumes import Capsule, Prism, distance_from_capsule
from palanquin.problems.robots import LAIKAGO, quadruped
from palanquin.sim.runs.nominal import follow

RANDOM = np.random.default_rng(0)
BEAM = (0.08, 2.0, 0.08)
OBSTACLES = {
    "box": box((0.3, -0.2), (1.0, 0.4), yaw=0.7, top=0.8),
    "wall": box((0.0, 0.0), (3.0, 0.02), top=0.5),
    "cylinder": cylinder((0.2, 0.1), 0.3, top=0.6),
    "rounded": (0.1, 0.2, -0.4, 0.3, 0.2, 0.15, 0.7),
}


def number(expression):
    return float(ca.evalf(ca.SX(expression)))


def surface(row, spacing=0.02):
    """Points of an obstacle's sides and top, `spacing` apart."""
    x, y, yaw, length, width, rounding, top = row
    angle = np.arange(0, 2 * np.pi, 0.05)
    rim = rounding * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    rim += np.sign(rim.round(9)) * [length, width]
    corners = np.array([[length, width + rounding], [length + rounding, width]])
    for end, other in ((corners[0], corners[0] * [-1, 1]), (corners[1], corners[1] * [1, -1])):
        share = np.arange(0, 1, spacing / 4)[:, None]
        side = end + share * (other - end)
        rim = np.concatenate([rim, side, -side])
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    levels = [np.column_stack([rim, np.full(len(rim), z)]) for z in np.arange(-0.2, top, spacing)]
    levels += [
        np.column_stack([scale * rim, np.full(len(rim), top)]) for scale in np.arange(0, 1.01, 0.02)
    ]
    points = np.concatenate(levels)
    points[:, :2] = points[:, :2] @ turn.T + [x, y]
    return points


@pytest.mark.parametrize("row", OBSTACLES.values(), ids=OBSTACLES)
def test_distance_of_points_is_that_of_the_surface(row):
    prism, samples = Prism.of(ca.SX(ca.DM(row)).T), surface(row)
    signs = set()
    for point in RANDOM.uniform([-1.5, -1.5, 0.0], [1.5, 1.5, 1.2], (40, 3)):
        signed = number(prism.distance(ca.SX(ca.DM(point))))
        signs.add(signed > 0)
        if signed > 0:  # inside, the distance is a lower one of several: only its sign counts
            brute = np.linalg.norm(samples - point, axis=1).min()
            assert signed == pytest.approx(brute, abs=0.015)
            assert signed <= brute + 1e-5
    assert True in signs


def gap(row, ends, radius):
    """The least distance of a capsule from an obstacle, as the module's rows have it."""
    prism = Prism.of(ca.SX(ca.DM(row)).T)
    capsule = Capsule("body", tuple(ca.SX(ca.DM(end)) for end in ends), radius)
    rows = [prism.distance(end) for end in capsule.ends]
    rows += [
        ca.if_else(is_one, prism.distance_of_corner(corner, capsule), np.inf)
        for corner, is_one in prism.corners()
    ]
    return min(number(r) for r in rows) - radius


@pytest.mark.parametrize("row", OBSTACLES.values(), ids=OBSTACLES)
def test_distance_of_capsules_is_that_of_their_points(row):
    """Beside the obstacle, where its height does not matter."""
    prism = Prism.of(ca.SX(ca.DM(row)).T)
    points = ca.SX.sym("p", 3)
    distance = ca.Function("d", [points], [prism.distance(points)]).map(400)
    touched = 0
    for _ in range(40):
        ends = np.column_stack([RANDOM.uniform(-2, 2, (2, 2)), RANDOM.uniform(0.1, 0.4, 2)])
        share = np.linspace(0, 1, 400)
        along = np.array(distance(np.outer(ends[0], 1 - share) + np.outer(ends[1], share)))
        if along.min() < 0.02:  # it runs through: other rows have stopped it before
            touched += 1
            continue
        assert gap(row, ends, 0.05) == pytest.approx(along.min() - 0.05, abs=2e-3)
    assert touched < 40


def test_distance_from_a_capsule_counts_its_nearest_point():
    for _ in range(50):
        ends, point = RANDOM.normal(size=(2, 3)), RANDOM.normal(size=3)
        capsule = Capsule("body", tuple(ca.SX(ca.DM(end)) for end in ends), 0.1)
        share = np.linspace(0, 1, 2001)[:, None]
        brute = np.linalg.norm(ends[0] + share * (ends[1] - ends[0]) - point, axis=1).min()
        exact = number(distance_from_capsule(ca.SX(ca.DM(point)), capsule))
        assert exact == pytest.approx(brute, abs=1e-3)


def test_a_sphere_is_a_capsule_without_length():
    capsule = Capsule("ball", (ca.SX([1, 2, 3]), ca.SX([1, 2, 3])), 0.1)
    assert number(distance_from_capsule(ca.SX([1, 2, 5]), capsule)) == pytest.approx(2.0)


@pytest.mark.parametrize("kind", ["laikago", "a1", "aliengo"])
def test_a_volume_holds_the_upper_edges_of_a_trunk(kind):
    model = quadruped(kind)
    volume = trunk_volume(model.lumped)
    top = np.array(model.trunk_centre) + np.array(model.trunk_size) / 2
    for x, end in ((top[0], volume[3]), (top[0] - model.trunk_size[0], volume[0])):
        assert np.hypot(x - end, top[2] - volume[5]) < volume[6]


def test_volumes_hold_the_bodies():
    volume = trunk_volume(LAIKAGO.single_rigid_body())
    for hip in LAIKAGO.single_rigid_body().hips:
        x = np.clip(hip[0], volume[0], volume[3])
        assert np.hypot(hip[0] - x, hip[1]) + 0.02 < volume[6]
    beam = beam_volume((0.08, 3.0, 0.06))
    np.testing.assert_allclose(beam[:6], [0, -1.5, 0, 0, 1.5, 0])
    assert beam[6] == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: m.Obstacles(-1, BEAM), "at_most is -1"),
        (lambda: m.Obstacles(1, (0.1, 0.0, 0.1)), "payload_size"),
        (lambda: m.Obstacles(1, BEAM, clearance=np.nan), "clearance is nan"),
        (lambda: m.Obstacles(1, BEAM, [OBSTACLES["box"], OBSTACLES["wall"]]), "2 are given"),
        (lambda: padded_obstacles([(0.0,) * 7], 2), r"obstacles\[0\].*not all 0"),
        (lambda: padded_obstacles([(0, 0, 0, -1, 1, 0, 1)], 2), "negative"),
        (lambda: padded_obstacles([(0, 0, np.nan, 1, 1, 0, 1)], 2), r"obstacles\[0, 2\] is nan"),
        (lambda: padded_obstacles([(0, 0, 1)], 2), "shape"),
        (lambda: box((0, 0), (1, 0)), "size"),
        (lambda: cylinder((0, 0), -1), "radius"),
        (lambda: Problem(1, 0.1).add(m.Obstacles(1, BEAM)), "after the robots' grasps"),
    ],
)
def test_bad_obstacles_say_what_is_wrong(make, message):
    with pytest.raises(ProblemError, match=message):
        make()


def test_rows_name_both_bodies(team_abreast):
    problem = clm.build_clm(team_abreast, obstacles=m.Obstacles(1, BEAM))
    rows = [(r.robot, r.limb) for r in problem.rows if r.name == "collision"]
    for owner in (
        ("payload", "obstacle1"),
        ("left", "obstacle1"),
        ("left", "obstacle1.RH"),
        ("left", "payload"),
        ("right", "left"),
        ("right", "ground"),
    ):
        assert owner in rows


def test_a_team_told_to_walk_into_a_wall_stops_before_it(team_abreast):
    wall = box((0.9, 0.0), (0.2, 4.0))
    problem = clm.build_clm(team_abreast, obstacles=m.Obstacles(1, BEAM, [wall]))
    planner = clm.Planner(problem)
    state = planner.nominal_state()
    planner.settle(0.0, state, clm.Velocity(0.3))
    for tick in range(120):
        plan = planner.solve(tick / 30, state, clm.Velocity(0.3 if tick < 80 else 0.0))
        assert plan.plan.is_usable
        _, state = follow(planner, plan, state, 1 / 30)
        assert state.bodies[0, 0] + beam_volume(BEAM)[6] < 0.8
    assert planner.reference[0] > 0.78
    assert state.bodies[0, 0] > 0.6
