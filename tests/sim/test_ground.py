"""The ground that physics stands on: its friction, and ditches as gaps."""

import mujoco
import numpy as np
import pytest

from palanquin.problems.terrains import Plane
from palanquin.sim.runs.hands_physics import held_scene
from palanquin.sim.scenarios import open_scenario
from palanquin.sim.scenarios.physical import physical
from palanquin.sim.scenarios.team import Ditch
from palanquin.sim.scenes.area import Area
from palanquin.sim.scenes.area_prisms import DEPTH, between_ditches

AREA = Area(-3.0, 4.0, -2.0, 2.0)
CROSSING = [Ditch(1.0, 0.0, -1.0, 0.3), Ditch(0.6, 0.8, 0.5, 0.25), Ditch(2.0, -1.0, 0.0, 0.1)]


@pytest.mark.parametrize("name", ["trot", "ditch", "stones", "ramp"])
def test_friction_is_the_worlds(name):
    scenario = physical(open_scenario(name)).changed(world={"friction": 0.37})
    scene = held_scene(scenario)
    data = scene.data()
    felt = set()
    for _ in range(60):  # without torques legs give way, feet slide
        mujoco.mj_step(scene.model, data)
        felt |= {tuple(contact.friction[:2]) for contact in data.contact}
    assert felt == {(0.37, 0.37)}


@pytest.mark.parametrize("ditches", [CROSSING, CROSSING[:1], [Ditch(0.0, 3.0, 30.0, 0.5)]])
def test_pieces_are_what_ditches_leave(ditches):
    pieces = between_ditches(Plane(0.1, 0.2, -0.1), ditches, AREA)
    points = np.random.default_rng(0).uniform((-3, -2), (4, 2), (3000, 2))
    depths = [d.d / 2 - np.abs(points @ (d.a, d.b) + d.c) / np.hypot(d.a, d.b) for d in ditches]
    covered = [
        (points @ spaces[:, :2].T + spaces[:, 2] <= 0).all(axis=1)
        for spaces in (piece.half_spaces() for piece in pieces)
    ]
    np.testing.assert_array_equal(np.sum(covered, axis=0), np.max(depths, axis=0) < 0)
    for piece in pieces:
        edge = piece.edge()
        np.testing.assert_allclose(edge[:, 2], 0.1 + 0.2 * edge[:, 0] - 0.1 * edge[:, 1])


def test_what_is_dropped_into_a_ditch_falls_to_its_floor():
    scenario = physical(open_scenario("ditch"))
    model = held_scene(scenario).model
    a, b, c, _ = scenario.ditch_lines[3]
    x, y = -c * np.array([a, b]) / (a**2 + b**2)
    for inside, height in ((True, -DEPTH), (False, 0.0)):
        point = np.array([x, y, 0.5]) if inside else np.array([-1.0, 0.0, 0.5])
        geom = np.zeros(1, np.int32)
        only_ground = np.array([1, 0, 0, 0, 0, 0], np.uint8)
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        distance = mujoco.mj_ray(
            model, data, point, np.array([0.0, 0.0, -1.0]), only_ground, 1, -1, geom
        )
        assert 0.5 - distance == pytest.approx(height, abs=1e-6)
