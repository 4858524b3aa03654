"""Foothold areas: their geometry against brute force, and feet that keep to them."""

import numpy as np
import pytest

from palanquin.errors import ProblemError
from palanquin.problems import clm
from palanquin.problems.foothold_areas import FootholdArea, FootholdAreas, nearest_in_polygons
from palanquin.problems.foothold_courses import stairs, stepping_stones, walkway
from palanquin.sim.runs.nominal import follow

RANDOM = np.random.default_rng(0)
PENTAGON = np.array([[0.0, 0.0], [1.0, -0.2], [1.5, 0.6], [0.7, 1.1], [-0.1, 0.8]])
STONES = stepping_stones(3, length=1.2, start=0.3, width=1.0)


def on_boundary(corners, count=4000):
    share = np.linspace(0, 1, count // len(corners), endpoint=False)[:, None]
    following = np.roll(corners, -1, axis=0)
    return np.concatenate([a + share * (b - a) for a, b in zip(corners, following, strict=True)])


@pytest.mark.parametrize("corners", [PENTAGON, PENTAGON[::-1]])
def test_half_spaces_hold_inside(corners):
    lines = FootholdArea(corners).half_spaces()
    np.testing.assert_allclose(np.hypot(lines[:, 0], lines[:, 1]), 1.0)
    weights = RANDOM.dirichlet(np.ones(5), 100)
    assert (weights @ corners @ lines[:, :2].T + lines[:, 2]).max() <= 1e-12
    outside = PENTAGON.mean(axis=0) + 3 * (PENTAGON - PENTAGON.mean(axis=0))
    assert ((outside @ lines[:, :2].T + lines[:, 2]).max(axis=1) > 0).all()


def test_nearest_point_of_a_polygon_is_the_nearest():
    points = RANDOM.uniform(-1, 2, (100, 2))
    found = nearest_in_polygons(np.tile(PENTAGON, (100, 1, 1)), points)
    lines = FootholdArea(PENTAGON).half_spaces()
    inside = (points @ lines[:, :2].T + lines[:, 2]).max(axis=1) <= 0
    np.testing.assert_array_equal(found[inside], points[inside])
    boundary = on_boundary(PENTAGON)
    brute = np.linalg.norm(boundary - points[~inside, None], axis=-1).min(axis=1)
    distance = np.linalg.norm(found - points, axis=-1)[~inside]
    np.testing.assert_allclose(distance, brute, atol=2e-3)
    assert (distance <= brute + 1e-12).all()
    assert 0 < inside.sum() < 100


def test_a_margin_shrinks_an_area():
    area = FootholdArea.rectangle((1.0, 2.0), (0.4, 0.2), z=0.3, yaw=0.5, slope=0.1)
    small = FootholdArea.rectangle((1.0, 2.0), (0.34, 0.14), z=0.3, yaw=0.5, slope=0.1)
    np.testing.assert_allclose(np.sort(area.shrunk(0.03), 0), np.sort(small.corners, 0))
    z0, ax, ay = area.plane
    assert z0 + ax * 1.0 + ay * 2.0 == pytest.approx(0.3)
    along = np.array([np.cos(0.5), np.sin(0.5)])
    assert np.array([ax, ay]) @ along == pytest.approx(0.1)


def exact_distances(terrain, point):
    """To each area, shrunk by the margin, seen from above."""
    corners = [area.shrunk(terrain.margin) for area in terrain.areas]
    return np.array([np.linalg.norm(nearest_in_polygons(c, point) - point) for c in corners])


def test_offers_are_the_nearest_areas_in_order():
    for xy in RANDOM.uniform([0.0, -0.5], [1.8, 0.5], (50, 2)):
        point = np.append(xy, 0.0)
        options = STONES.options(point)
        distance = np.linalg.norm(options[:, :2] - xy, axis=1)
        assert (np.diff(distance) >= 0).all()
        exact = np.sort(exact_distances(STONES, xy))
        np.testing.assert_allclose(distance[:2], exact[:2], atol=1e-12)
        np.testing.assert_array_equal(STONES.nearest(point), options[0])
        np.testing.assert_allclose(STONES.height(*options[0, :2]), options[0, 2], atol=1e-12)


def test_surroundings_are_those_of_the_area_below():
    for area in STONES.areas:
        x, y = area.corners.mean(axis=0)
        around = STONES.around(np.array([x, y, float(area.plane[0])]))
        np.testing.assert_array_equal(around["plane"], area.plane)
        np.testing.assert_allclose(around["sides"][:4], area.half_spaces(STONES.margin))
        assert STONES.height(x, y) == pytest.approx(area.plane[0])


def test_of_areas_above_each_other_the_height_decides():
    low = FootholdArea.rectangle((0, 0), (4, 4))
    bridge = FootholdArea.rectangle((0, 0), (2, 1), z=0.5)
    terrain = FootholdAreas((low, bridge))
    for z, plane in ((0.1, low.plane), (0.4, bridge.plane)):
        np.testing.assert_array_equal(terrain.around(np.array([0.3, 0, z]))["plane"], plane)
    assert terrain.height(0.3, 0.0) == 0.5
    np.testing.assert_array_equal(terrain.gradient(0.3, 0.0), [0.0, 0.0])


def test_trend_of_stairs_climbs_smoothly():
    flight = stairs(steps=8, rise=0.1, tread=0.3, start=0.5, width=2.0)
    x = np.linspace(-1, 4, 200)
    climb = flight.trend.height(x, 0.0)
    assert climb[0] == pytest.approx(0.0, abs=1e-3)
    assert climb[-1] == pytest.approx(0.8, abs=1e-3)
    slope = flight.trend.gradient(x, 0.0)[:, 0]
    assert slope.min() > -1e-3
    assert slope.max() < 0.42  # of the flight itself: 1 / 3


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: FootholdArea([[0, 0], [1, 0]]), r"shape \(2, 2\)"),
        (lambda: FootholdArea([[0, 0], [1, 0], [1, np.nan]]), "must be finite"),
        (lambda: FootholdArea([[0, 0], [2, 0], [1, 0.1], [1, 2]]), "convex"),
        (lambda: FootholdArea([[0, 0], [1, 0], [2, 0], [0, 1]]), "straight corners"),
        (lambda: FootholdArea.rectangle((0, 0), (1, 0)), "size"),
        (lambda: FootholdAreas(()), "there is none"),
        (lambda: FootholdAreas((FootholdArea.rectangle((0, 0), (1, 0.03)),)), "too small"),
        (lambda: FootholdAreas((FootholdArea(PENTAGON),), sides=4), "5 sides; at most 4"),
        (lambda: stairs(0, 0.1, 0.3, 0.0, 2.0), "steps is 0"),
        (lambda: stairs(3, np.inf, 0.3, 0.0, 2.0), "rise is inf"),
        (lambda: stepping_stones(-1, 1.0, 0.0, 1.0), "seed is -1"),
        (lambda: stepping_stones(0, 1.0, 0.0, 1.0, size=0.3), "less than the pitch"),
        (lambda: walkway((), 0.2, 0.0, 1.0, 2.0), "lanes is empty"),
    ],
)
def test_bad_areas_say_what_is_wrong(make, message):
    with pytest.raises(ProblemError, match=message):
        make()


COURSES = {
    "stairs": stairs(steps=3, rise=0.1, tread=0.3, start=0.4, width=2.4),
    "stones": stepping_stones(1, length=1.0, start=0.4, width=2.4),
    "walkway": walkway((0.73, 0.47, -0.47, -0.73), 0.14, 0.4, 1.0, 2.4, height=0.05),
}


@pytest.mark.parametrize(("course", "candidates"), [("stairs", 1), ("stones", 3), ("walkway", 1)])
def test_feet_keep_to_the_areas(team_abreast, course, candidates):
    terrain = COURSES[course]
    problem = clm.build_clm(team_abreast, terrain=terrain)
    planner = clm.Planner(problem, terrain, candidates=candidates)
    state, command = planner.nominal_state(), clm.Velocity(0.4)
    planner.settle(0.0, state, command)
    for tick in range(120):
        plan = planner.solve(tick / 30, state, command)
        now, state = follow(planner, plan, state, 1 / 30)
        for foot in now.feet[plan.contacts[0]]:
            assert exact_distances(terrain, foot[:2]).min() < 1e-3
            assert foot[2] == pytest.approx(terrain.height(*foot[:2]), abs=1e-9)
    assert state.bodies[0, 0] > 1.5
    error = np.linalg.norm(state.bodies[0, :3] - plan.references.bodies[1, 0, :3])
    assert error < 0.02
